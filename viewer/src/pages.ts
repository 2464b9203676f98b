// The pages but for the 3-D view: overview, object, grasp, compare, sweep, run.
import * as data from './data';
import type { Cell, Control, Details, Direction, Evaluation, Grasp, Overview, Pair, Success, TestHead } from './data';
import { outcomeColours } from './colours';
import { append, h, select, table } from './dom';
import { badge, graspRows, graspTable, type GraspRow } from './grasptable';
import { num, text } from './numbers';
import { plot, type Row } from './plot';
import { Panel, type State } from './viewer3d';

export interface Place { path: string[]; state: State; remember: () => void }
export interface Page { title: string; nodes: Node[]; start?: () => Promise<void>; leave?: () => void }

const section = (title: string, ...children: (Node | string | null | (Node | null)[])[]) => h('section', {}, h('h2', {}, title), children);

// ---- overview ----

function intervalBar(rate: { share: number; low: number; high: number }): HTMLElement {
  const at = (x: number) => `${(100 * x).toFixed(2)}%`;
  return h('span', { class: 'interval', 'aria-hidden': 'true' },
    h('span', { class: 'range', style: `left:${at(rate.low)};width:${at(rate.high - rate.low)}` }), h('span', { class: 'mark', style: `left:${at(rate.share)}` }));
}

const groupTitles: Record<string, string> = { object: 'by object', hand: 'by hand', heuristic: 'by heuristic' };

function success(overview: Overview): HTMLElement | null {
  if (overview.success.length === 0) return null;
  const groups = new Map<string, Success[]>();
  for (const one of overview.success) groups.set(one.by, [...(groups.get(one.by) ?? []), one]);
  const blocks = [...groups].map(([by, list]) => h('div', { class: 'group' }, h('h3', {}, groupTitles[by] ?? `by ${by}`),
    table([by === 'heuristic' ? 'heuristic' : by, 'held', '', 'share', '95 % interval'], list.map((one) => [
      by === 'object' ? h('a', { href: `#object/${encodeURIComponent(String(one.value))}` }, String(one.value))
        : one.value === null || one.value === '' ? 'none: lost before a grasp' : String(one.value),
      [num('held', one.held), ' of ', num('rows', one.rows)], intervalBar(one), num('share', one.share), [num('share', one.low), ' – ', num('share', one.high)],
    ]), `success ${groupTitles[by] ?? by}`)));
  return section('Success', h('p', {}, 'Share of grasps that the force test calls held. A pair that was lost on the way counts as one that was not. Wilson’s interval takes grasps as independent; those of one object are not, so the truth is less sure than it says.'),
    h('div', { class: 'groups' }, blocks));
}

function scatter(rows: GraspRow[]): HTMLElement | null {
  const points = rows.filter((row) => typeof row.cells.score_winding_angle_rad === 'number').map((row): Row => ({
    object: row.cells.object, hand: row.cells.hand, grasp: row.cells.grasp, winding_angle_rad: row.cells.score_winding_angle_rad,
    curvature_sum_rad: row.cells.score_curvature_sum_rad, outcome: row.cells.outcome || 'not tested',
  }));
  if (points.length < 2) return null;
  const used = [...new Set(points.map((one) => String(one.outcome)))];
  return plot('Scores of the grasps', 'S1 says circle cage, S2 sphere cage; colour and shape: the force test.', {
    width: 'container', height: 260, mark: { type: 'point', filled: true, size: 70, opacity: 0.8 },
    encoding: {
      x: { field: 'winding_angle_rad', type: 'quantitative', scale: { zero: false }, title: 'S1 winding angle [rad]' },
      y: { field: 'curvature_sum_rad', type: 'quantitative', scale: { zero: false }, title: 'S2 total curvature [rad]' },
      color: { field: 'outcome', type: 'nominal', scale: { domain: used, range: used.map((one) => outcomeColours[one] ?? '#555') } },
      shape: { field: 'outcome', type: 'nominal', scale: { domain: used } },
      tooltip: ['object', 'hand', 'grasp', 'winding_angle_rad', 'curvature_sum_rad', 'outcome'].map((field) => ({ field })),
    },
  }, points, ['object', 'hand', 'grasp', 'winding_angle_rad', 'curvature_sum_rad', 'outcome']);
}

export function overviewPage(overview: Overview): Page {
  const { counts } = overview;
  const sum = counts.done + counts.failed + counts.rejected + counts.skipped;
  const rows = graspRows(overview);
  const plots = h('div', { class: 'plots' });
  const invalid = overview.pairs.filter((pair) => pair.outcome !== 'done');
  return {
    title: overview.title,
    nodes: [
      h('h1', {}, overview.title),
      h('p', {}, 'Caging grasps from scans: where each surface invites a hand, how the hand closed there, and whether it kept the object in the simulated tests. Open an object or a grasp to see why.'),
      h('div', { class: 'tiles' }, (['in', 'done', 'failed', 'rejected', 'skipped'] as const).map((name) =>
        h('div', { class: 'tile' }, h('b', {}, num(`counts.${name}`, counts[name])), name === 'in' ? 'pairs' : name))),
      h('p', { class: sum === counts.in ? 'soft' : 'warning' }, sum === counts.in
        ? `The counts add up: ${counts.done} + ${counts.failed} + ${counts.rejected} + ${counts.skipped} = ${sum}, every object-hand pair once.`
        : `The counts do not add up: ${sum}, but ${counts.in} pairs went in. Please report this.`),
      ...[success(overview)].filter((x) => x !== null),
      section('Grasps', h('p', { class: 'soft' }, 'Best first within each object and hand. Click a head to sort, a picture to see the grasp in 3-D.'), graspTable(overview, rows)),
      section('How scores and outcomes go together', plots),
      ...(invalid.length ? [section('Failed, rejected and skipped', table(['object', 'hand', 'outcome', 'why'],
        invalid.map((pair) => [pair.object, pair.hand, badge(pair.outcome), pair.sentence]), 'failed, rejected and skipped'))] : []),
      section('What these figures mean, and what they don’t',
        h('p', {}, h('b', {}, 'Held'), ' says: in a simulator, with this friction and these motors, the closing hand kept the object while it was pushed six ways. It does not prove a cage and is no promise for a real hand. The cage test locks the fingers and takes friction away; a way out that it did not find is no proof that there is none.'),
        h('p', {}, h('b', {}, 'Lost'), ' grasps are results, not faults of the run. They count, and so do grasps that were rejected, that never settled, or whose simulation failed.')),
    ],
    start: async () => append(plots, [scatter(rows) ?? h('p', { class: 'soft' }, 'Fewer than two grasps have both scores.')]),
  };
}

// ---- object ----

export function objectPage(overview: Overview, place: Place): Page {
  const name = decodeURIComponent(place.path[1] ?? '');
  const pairs = overview.pairs.map((pair, index) => ({ pair, index })).filter(({ pair }) => pair.base === name || pair.object === name);
  if (pairs.length === 0) return { title: name, nodes: [h('h1', {}, 'There is no such object here'), h('p', {}, name)] };
  let panel: Panel | null = null;
  const box = h('div'), facts = h('div');
  const titled = (pair: Pair) => `${pair.hand}${pair.object === pair.base ? '' : ' ' + pair.object.slice(pair.base.length)}`;
  let which = Math.max(0, pairs.findIndex(({ index }) => String(index) === place.state.get('pair')));
  const open = async () => {
    panel?.dispose();
    panel = null;
    const { pair, index } = pairs[which];
    if (!pair.details) {
      box.replaceChildren(h('p', {}, pair.sentence || 'There is nothing to show: the pair ended before its scores.'));
      facts.replaceChildren();
      return;
    }
    const details = await data.json<Details>(pair.details);
    panel = new Panel({ pair, details, grasp: null, label: `${pair.object}, scored for ${pair.hand}`, candidates: true }, place.state, place.remember);
    box.replaceChildren(panel.element);
    facts.replaceChildren(objectFacts(pair, details, index));
    await panel.start();
  };
  const { pair } = pairs[0];
  return {
    title: name,
    nodes: [
      h('h1', {}, name),
      h('p', { class: 'soft' }, `${pair.source}. `, overview.tables.length === 0 ? null : pair.truth_known ? 'The file is the true surface; it was scanned by a virtual camera, and the grasps know the scan alone.' : 'The file is a scan; nobody knows the true surface.'),
      pairs.length > 1 ? h('p', {}, select('scored for', pairs.map((one, i): [string, string] => [String(i), titled(one.pair)]), String(which), (value) => {
        which = Number(value);
        place.state.set('pair', String(pairs[which].index));
        place.remember();
        void open();
      })) : null,
      box, facts,
      overview.tables.length === 0 ? null : section('All hands', allHands(pairs)),
      overview.tables.length === 0 ? null : section('Its grasps', graspTable(overview, graspRows(overview).filter((row) => pairs.some(({ index }) => index === row.pair)))),
    ].filter((x) => x !== null),
    start: open,
    leave: () => panel?.dispose(),
  };
}

function allHands(pairs: { pair: Pair; index: number }[]): HTMLElement {
  return table(['hand', 'outcome', 'grasps', 'best grasp', ''], pairs.map(({ pair, index }) => [
    `${pair.hand}${pair.object.slice(pair.base.length)}`, badge(pair.outcome), pair.pictures ? num('grasps', pair.pictures.length) : '–',
    pair.pictures?.[0] ? h('a', { href: `#grasp/${index}/0`, 'aria-label': `best grasp of ${pair.hand}` }, h('img', { src: data.picture(pair.pictures[0]), alt: '', width: 96, height: 72, loading: 'lazy' })) : '–',
    pair.sentence,
  ]), 'all hands');
}

function objectFacts(pair: Pair, details: Details, index: number): HTMLElement {
  const rejected = Object.entries(details.rejected);
  return h('div', {},
    details.candidates.length === 0 && !details.evaluation && !details.grasps.length ? null : section('Candidates', h('p', { class: 'soft' }, 'Where the scores propose to close a hand, best first within each heuristic. White balls in the view: winding angle; green: total curvature.'),
      details.candidates.length ? table(['', 'heuristic', 'score', 'S1 winding', 'S2 curvature', 'Euler'], details.candidates.map((one, i) => [
        i + 1, one.heuristic, num('score', one.score), num('winding_angle_rad', one.winding_angle_rad), num('curvature_sum_rad', one.curvature_sum_rad), num('euler', one.euler),
      ]), 'candidates') : h('p', {}, 'None.')),
    rejected.length ? section('Poses turned down before any test', table(['rule', 'poses'], rejected.map(([rule, count]) => [rule, num('rejected', count)]), 'poses turned down'),
      h('p', { class: 'soft' }, h('a', { href: `#grasp/${index}/0` }, `The best grasp of ${pair.hand}`))) : null);
}

// ---- grasp ----

function pushes(title: string, directions: Direction[] | undefined, note: string): HTMLElement | null {
  if (!directions?.length) return null;
  return section(title, h('p', { class: 'soft' }, note), table(['direction', '', 'moved', 'turned', 'ended after'], directions.map((one) => [
    one.name, h('span', { class: `push ${one.held ? 'held' : 'lost'}` }, one.held ? (one.held_within_2_cm === false ? '✓ held, beyond 2 cm' : '✓ held') : `✗ ${one.outcome ?? 'lost'}`), num('max_displacement_m', one.max_displacement_m),
    num('max_rotation_rad', one.max_rotation_rad), num('ended_s', one.ended_s),
  ]), title));
}

const scoreNotes: Record<string, string> = {
  winding_angle_rad: 'S1: how far fingers can reach round the surface here (360°: a ring)', curvature_sum_rad: 'S2: 0 on a tube, 360° on a half ball, more on a knob with a neck',
  blocked_share: 'straight ways out of the closed hand that are blocked', closure_margin: 'how far the contacts are from letting the object go without friction', contacts: 'links that touch',
  rank: 'what grasps are ordered by', ferrari_canny_low: 'Ferrari-Canny epsilon, lower bound', ferrari_canny_high: 'its upper bound',
  enclosed_share: 'directions from the ball’s centre that the hand covers', com_offset_m: 'the centre of mass from the approach line', candidate: 'which candidate, counted from zero',
};

/** Why this grasp stands where it stands, in sentences made of its own figures. */
function story(grasp: Grasp, index: number, details: Details, weight: string | undefined): HTMLElement {
  const say = (name: string) => num(name, grasp.scores[name]);
  const has = (name: string) => typeof grasp.scores[name] === 'number';
  type Piece = Node | string | null | Piece[];
  const lines: Piece[][] = [];
  const candidate = typeof grasp.scores.candidate === 'number' ? details.candidates[grasp.scores.candidate] : undefined;
  if (candidate)
    lines.push([h('b', {}, 'Place. '), `Proposed by ${candidate.heuristic}: around this spot the surface `,
      typeof candidate.winding_angle_rad === 'number' ? ['winds by ', num('winding_angle_rad', candidate.winding_angle_rad)] : 'has no dominant axis to wind round',
      ' and holds ', num('curvature_sum_rad', candidate.curvature_sum_rad), ' of curvature. ',
      (candidate.winding_angle_rad ?? 0) > 6.2 ? 'The fingers can close a ring round it.' : candidate.curvature_sum_rad > 6 ? 'A hand can cap it like a ball.' : 'It is neither a full ring nor a full cap.']);
  if (has('blocked_share'))
    lines.push([h('b', {}, 'Closing. '), 'The closed hand blocks ', num('share', grasp.scores.blocked_share), ' of the straight ways out',
      has('contacts') ? ', with ' : null, has('contacts') ? say('contacts') : null, has('contacts') ? ' links in contact' : null,
      has('closure_margin') ? '; its closure margin is ' : null, has('closure_margin') ? say('closure_margin') : null, '.']);
  if (has('rank')) {
    const other = details.grasps[index === 0 ? 1 : 0];
    const of = (name: string) => grasp.scores[name] ?? 0, opposed = has('opposition');
    // Said where it is so: other ways to rank (place.rank_by) add up differently.
    const adds = weight !== undefined && Math.abs(of('blocked_share') + Number(weight) * of('closure_margin') + of('opposition') - of('rank')) < 1e-9;
    lines.push([h('b', {}, 'Rank. '), say('rank'), adds ? [' = blocked share + ', h('code', {}, weight), ' × closure margin (parameter ', h('code', {}, 'place.margin_weight'), ')', opposed ? ' + opposition' : null] : null,
      index === 0 ? ', the highest of this object and hand' : null,
      other && typeof other.scores.rank === 'number' ? [index === 0 ? '; the next one has ' : '; the best one has ', num('rank', other.scores.rank),
        typeof other.scores.blocked_share === 'number' ? [': it blocks ', num('share', other.scores.blocked_share)] : null,
        typeof other.scores.closure_margin === 'number' ? [' with a margin of ', num('closure_margin', other.scores.closure_margin)] : null] : null,
      '. Rank is made before any test, and knows nothing of its outcome.']);
  }
  if (grasp.force_closure)
    lines.push([h('b', {}, 'Force closure. '), grasp.force_closure, has('ferrari_canny_low') ? '; epsilon ' : null, has('ferrari_canny_low') ? say('ferrari_canny_low') : null,
      has('ferrari_canny_high') ? ' to ' : null, has('ferrari_canny_high') ? say('ferrari_canny_high') : null, '.']);
  if (grasp.approach)
    lines.push([h('b', {}, 'Way. '), grasp.approach.outcome && grasp.approach.outcome !== 'planned' ? `none: ${grasp.approach.outcome}.` : 'planned, ',
      ...(grasp.approach.outcome && grasp.approach.outcome !== 'planned' ? [] : [num('seconds_s', grasp.approach.seconds), ' long, ', num('min_clearance_m', grasp.approach.min_clearance_m), ' free',
        grasp.approach.certified ? ', certified free of collision all the way.' : '.'])]);
  const test = grasp.evaluation, pushes = test?.summary;
  if (test) lines.push([h('b', {}, 'Force test. '), badge(test.outcome), ` ${test.reason}`]);
  if (pushes?.worst)
    lines.push([num('held', pushes.held), ' of ', num('pushes', pushes.pushes), ' pushes held, ', num('held_within_2_cm', pushes.held_within_2_cm), ` of them within 2 cm; the worst is ${pushes.worst}`,
      pushes.fall_s === null ? '.' : [', lost after ', num('fall_s', pushes.fall_s), '.']]);
  if (grasp.cage) lines.push([h('b', {}, 'Cage test. '), badge(grasp.cage.outcome), ` ${grasp.cage.reason}`]);
  return h('ul', { class: 'story' }, lines.map((line) => h('li', {}, line)));
}

function controls(title: string, head: TestHead | null): HTMLElement | null {
  if (!head?.controls?.length) return null;
  const ok = head.controls.every((one: Control) => one.ok);
  return h('details', {}, h('summary', {}, `${title}: controls ${ok ? 'answer as they must' : 'failed, the test is not valid'}`),
    table(['control', 'grasps', 'trials held', 'rule', ''], head.controls.map((one) => [one.name, num('grasps', one.grasps), [num('held', one.held), ' of ', num('trials', one.trials)], one.rule, one.ok ? 'as it must be' : h('b', {}, 'failed')]), `${title}: controls`),
    head.engine ? table(['setting', 'value'], Object.entries(head.engine).map(([key, value]) => [key, typeof value === 'number' ? num(`engine.${key}`, value) : String(value)]), `${title}: settings`) : null);
}

/** Kaplan and Meier's share still held over time, a step line an amplitude. */
function survivalPlot(wrenches: NonNullable<Evaluation['wrenches']>, horizon: Cell | undefined): HTMLElement | null {
  const rows: Row[] = [];
  for (const one of wrenches) {
    const curve = one.curve_s_share ?? [];
    for (const [seconds, share] of curve) rows.push({ weights: one.amplitude_weights, seconds, share });
    if (curve.length && typeof horizon === 'number') rows.push({ weights: one.amplitude_weights, seconds: horizon, share: curve[curve.length - 1][1] });
  }
  if (!rows.length) return null;
  return plot('Survival under random wrenches', 'Share of the trials still held, by the amplitude in weights of the object.', {
    mark: { type: 'line', interpolate: 'step-after', strokeWidth: 2 },
    encoding: {
      x: { field: 'seconds', type: 'quantitative', title: 'time [s]' }, y: { field: 'share', type: 'quantitative', title: 'share still held', scale: { domain: [0, 1] } },
      color: { field: 'weights', type: 'ordinal', title: 'weights' }, strokeDash: { field: 'weights', type: 'ordinal' },
    },
  }, rows, ['weights', 'seconds', 'share']);
}

function graspFacts(grasp: Grasp, index: number, details: Details, weight: string | undefined): (Node | null)[] {
  const cage = grasp.cage;
  return [
    section('Why', story(grasp, index, details, weight)),
    h('div', { class: 'columns' }, ...[pushes('Pushes of the force test', grasp.evaluation?.directions, 'The closing hand holds with friction; the object is pushed along each axis of its own frame.'),
      pushes('Pulls of the cage test', cage?.directions, 'Fingers locked, no friction: gravity along each axis.'),
      pushes('Pulls with motors', cage?.compliant, 'The same without friction, with motors that give way in place of locked fingers.'),
      pushes('Ring test', cage?.ring, 'Gravity across the closing axis, with motion along that axis locked.')],
    cage?.wrenches?.length ? section('Random wrenches', table(['weights', 'trials', 'lost', 'survival', 'mean held'], cage.wrenches.map((one) => [
      num('amplitude_weights', one.amplitude_weights), num('trials', one.trials), num('lost', one.lost), num('survival', one.survival), num('mean_held_s', one.mean_held_s)]), 'random wrenches'),
    cage.a_50 ? h('p', {}, 'Half are still held at the end at ', cage.a_50.is === 'at' ? null : h('b', {}, `${cage.a_50.is} `), num('a_50', cage.a_50.weights), ' weights',
      cage.a_50.is === 'at' ? ' (on the line between two amplitudes).' : ', the outermost amplitude tested.') : null,
    survivalPlot(cage.wrenches, details.cage?.engine?.wrench_s),
    h('p', { class: 'soft' }, `Search for a way out: ${cage.escape_search?.result ?? 'not made'}.`,
      cage.escape_search?.rise_m?.length ? [' ', num('found', cage.escape_search.found), ' of ', num('seeds', cage.escape_search.seeds), ' searches found one; against the kindest gravity the centre of mass rises by at most ', num('rise_m', Math.min(...cage.escape_search.rise_m)), ' on it',
        cage.escape_search.unfound_rise_m ? ', bisected against all six.' : '.'] : null)) : null),
    Object.keys(grasp.scores).length === 0 ? null : section('Scores', table(['score', 'value', 'what it says'], Object.entries(grasp.scores).map(([name, value]) => [name, num(name, value), scoreNotes[name] ?? '']), 'scores')),
    !details.evaluation && !details.cage ? null : section('Tests', controls('Force test', details.evaluation), controls('Cage test', details.cage)),
  ];
}

export function graspPage(overview: Overview, place: Place): Page {
  const index = Number(place.path[2] ?? 0), pairIndex = Number(place.path[1]), pair = overview.pairs[pairIndex];
  if (!pair?.details) return { title: 'grasp', nodes: [h('h1', {}, 'There is no such grasp here')] };
  let panel: Panel | null = null;
  const box = h('div'), facts = h('div');
  const count = pair.pictures?.length ?? 0;
  return {
    title: `${pair.object} ${index + 1}`,
    nodes: [
      h('h1', {}, h('a', { href: `#object/${encodeURIComponent(pair.base)}` }, pair.object), ' ', h('span', { class: 'soft' }, 'with'), ` ${pair.hand}, grasp ${index + 1}`),
      h('p', { class: 'row' }, index > 0 ? h('a', { href: `#grasp/${pairIndex}/${index - 1}` }, '← better ranked') : h('span', { class: 'soft' }, 'the best ranked'),
        index + 1 < count ? h('a', { href: `#grasp/${pairIndex}/${index + 1}` }, 'next →') : null,
        count > 1 ? h('a', { href: `#compare/${pairIndex}/${index}/${pairIndex}/${index === 0 ? 1 : 0}` }, 'side by side') : null),
      box, facts,
    ],
    start: async () => {
      const details = await data.json<Details>(pair.details!);
      const grasp = details.grasps[index];
      if (!grasp) {
        facts.replaceChildren(h('p', {}, `This pair has ${details.grasps.length} grasps.`));
        return;
      }
      const slot = overview.parameters.find((one) => one.slot === `${pair.object}/place/${pair.hand}`);
      const weight = slot?.values.find(([name]) => name === 'margin_weight')?.[1];
      facts.replaceChildren(...graspFacts(grasp, index, details, weight).filter((x) => x !== null));
      panel = new Panel({ pair, details, grasp, label: `${pair.hand} on ${pair.object}, grasp ${index + 1}`, candidates: false }, place.state, place.remember);
      box.replaceChildren(panel.element);
      await panel.start();
    },
    leave: () => panel?.dispose(),
  };
}

// ---- compare ----

export function comparePage(overview: Overview, place: Place): Page {
  const sides = [[Number(place.path[1]), Number(place.path[2])], [Number(place.path[3]), Number(place.path[4])]];
  const panels: Panel[] = [];
  const boxes = h('div', { class: 'side-by-side' }), facts = h('div');
  let linked = true;
  const start = async () => {
    const loaded: { pair: Pair; details: Details; grasp: Grasp; index: number; pairIndex: number }[] = [];
    for (const [pairIndex, index] of sides) {
      const pair = overview.pairs[pairIndex];
      const details = pair?.details ? await data.json<Details>(pair.details) : null;
      const grasp = details?.grasps[index];
      if (!details || !grasp) {
        boxes.replaceChildren(h('p', {}, 'One of these grasps is not here.'));
        return;
      }
      loaded.push({ pair, details, grasp, index, pairIndex });
    }
    for (const one of loaded) {
      const panel = new Panel({ ...one, label: `${one.pair.hand} on ${one.pair.object}, grasp ${one.index + 1}`, candidates: false }, new URLSearchParams(), () => {});
      panels.push(panel);
      boxes.append(h('div', {}, h('h2', {}, h('a', { href: `#grasp/${one.pairIndex}/${one.index}` }, `${one.pair.object}, ${one.pair.hand}, grasp ${one.index + 1}`)), panel.element));
    }
    const names = [...new Set(loaded.flatMap((one) => Object.keys(one.grasp.scores)))];
    facts.append(section('Side by side', table(['', ...loaded.map((one) => `${one.pair.object}, grasp ${one.index + 1}`)], [
      ['force test', ...loaded.map((one) => (one.grasp.evaluation ? badge(one.grasp.evaluation.outcome) : '–'))],
      ['cage test', ...loaded.map((one) => (one.grasp.cage ? badge(one.grasp.cage.outcome) : '–'))],
      ['force closure', ...loaded.map((one) => one.grasp.force_closure ?? '–')],
      ...names.map((name) => [name, ...loaded.map((one) => num(name, one.grasp.scores[name]))]),
    ], 'side by side')));
    await Promise.all(panels.map((panel) => panel.start()));
    const [a, b] = panels.map((panel) => panel.view);
    if (a && b && loaded[0].pair.model === loaded[1].pair.model) b.eye = a.eye;
    panels.forEach((panel, i) => (panel.onCamera = () => {
      const other = panels[1 - i].view;
      if (!linked || !panel.view || !other || document.activeElement !== panel.view.canvas && !panel.element.matches(':hover')) return;
      other.eye = panel.view.eye;
    }));
  };
  const link = h('input', { type: 'checkbox', checked: true, onchange: () => (linked = link.checked) });
  return {
    title: 'two grasps', nodes: [h('h1', {}, 'Two grasps'), h('p', {}, h('label', { class: 'check' }, link, ' turn both together')), boxes, facts], start,
    leave: () => panels.forEach((panel) => panel.dispose()),
  };
}

// ---- sweep ----

const recordsOf = (overview: Overview, name: string): Row[] => {
  const found = overview.tables.find((one) => one.name === name);
  return (found?.rows ?? []).map((row) => Object.fromEntries(found!.columns.map((column, i) => [column, row[i]])));
};

export function sweepPage(overview: Overview): Page {
  const rates = recordsOf(overview, 'rates'), paired = recordsOf(overview, 'paired'), grasps = recordsOf(overview, 'grasps');
  const columns = overview.tables.find((one) => one.name === 'rates')?.columns ?? [];
  const known = ['hand', 'measure', 'trials', 'hits', 'rate', 'wilson_low', 'wilson_high', 'objects', 'bootstrap_low', 'bootstrap_high', 'setting'];
  const settings = columns.filter((name) => name.includes('.') && !known.includes(name));
  const curves = h('div', { class: 'plots' }), differences = h('div', { class: 'plots' }), histograms = h('div', { class: 'plots' });
  const escape = (name: string) => name.replaceAll('.', '\\.').replaceAll('[', '\\[').replaceAll(']', '\\]');
  const hands = new Set(rates.map((row) => row.hand));
  /** What tells a line from others: its levels, and its hand where there are several or nothing else. */
  const seriesOf = (row: Row, names: string[]) => [...(hands.size > 1 || names.length === 0 ? [row.hand] : []), ...names.map((name) => `${name}=${row[name]}`)].join(' ');
  /** A figure of each measure over a setting, a line a series: a band from bootstraps, whiskers from `low` to `high`. */
  const drawOver = (into: HTMLElement, all: Row[], setting: string, caption: string, y: { value: string; low: string; high: string; share: boolean }, columns: string[]) => {
    into.replaceChildren();
    const numeric = all.every((row) => typeof row[setting] === 'number');
    const others = settings.filter((name) => name !== setting);
    for (const measure of [...new Set(all.map((row) => String(row.measure)))]) {
      const rows = all.filter((row) => row.measure === measure);
      for (const row of rows) row.series = seriesOf(row, others);
      const levels = [...new Set(rows.map((row) => row[setting]))];
      const encoding = {
        x: { field: escape(setting), type: numeric ? 'quantitative' : 'ordinal', title: setting, ...(numeric && levels.length <= 12 ? { axis: { values: levels } } : {}) },
        ...(numeric ? {} : { xOffset: { field: 'series' } }),
        color: { field: 'series', type: 'nominal', title: null, scale: { range: ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9'] } },
      };
      const value = { field: y.value, type: 'quantitative' };
      const having = (field: string) => [{ filter: `isValid(datum.${field})` }]; // no interval of a single object
      into.append(plot(`${measure} over ${setting}`, caption, {
        width: 'container', height: 260, encoding,
        layer: [
          ...(numeric ? [{ transform: having('bootstrap_low'), mark: { type: 'area', opacity: 0.15 }, encoding: { y: { field: 'bootstrap_low', type: 'quantitative' }, y2: { field: 'bootstrap_high' } } },
            { mark: { type: 'line' }, encoding: { y: value } }] : []),
          { transform: having(y.low), mark: { type: 'rule', strokeWidth: 2 }, encoding: { y: { field: y.low, type: 'quantitative', title: y.share ? 'share' : measure, ...(y.share ? { scale: { domain: [0, 1] } } : {}) }, y2: { field: y.high } } },
          { mark: { type: 'point', filled: true, opacity: 1, size: 60 }, encoding: { y: value, shape: { field: 'series', type: 'nominal', title: null } } },
        ],
      }, rows, columns));
    }
  };
  const drawCurves = (setting: string) => drawOver(curves, rates, setting, 'Dots: share; whiskers: Wilson’s 95 % interval; band: bootstrap over objects, where there are several. Seeds are pooled.',
    { value: 'rate', low: 'wilson_low', high: 'wilson_high', share: true },
    ['hand', ...settings, 'trials', 'rate', 'wilson_low', 'wilson_high', 'bootstrap_low', 'bootstrap_high'].filter((name) => columns.includes(name) || name === 'hand'));
  const drawDifferences = () => {
    const pairedColumns = overview.tables.find((one) => one.name === 'paired')?.columns ?? [];
    const mean = pairedColumns.find((name) => /difference|mean/.test(name)) ?? '';
    const low = pairedColumns.find((name) => /low/.test(name)) ?? '', high = pairedColumns.find((name) => /high/.test(name)) ?? '';
    if (paired.length === 0 || !mean) {
      differences.append(h('p', { class: 'soft' }, 'No two levels share an object, hand and seed.'));
      return;
    }
    for (const row of paired) row.what = `${row.setting}: ${row.other} against ${row.first}${hands.size > 1 ? ` (${row.hand})` : ''}`;
    differences.append(plot('Paired differences', 'Best grasp held at a level minus at the first level, on the same object, hand and seed; bars: bootstrap over objects, where there are several.', {
      width: 'container', height: { step: 26 },
      layer: [{ mark: { type: 'rule', strokeDash: [4, 4] }, encoding: { x: { datum: 0, type: 'quantitative' } } },
        { transform: [{ filter: `isValid(datum.${low})` }], mark: { type: 'rule', strokeWidth: 3, color: '#0072B2' }, encoding: { y: { field: 'what', type: 'nominal', title: null }, x: { field: low, type: 'quantitative', title: 'difference of shares', scale: { domain: [-1, 1] } }, x2: { field: high } } },
        { mark: { type: 'point', filled: true, opacity: 1, size: 80, color: '#0072B2' }, encoding: { y: { field: 'what', type: 'nominal' }, x: { field: mean, type: 'quantitative' } } }],
    }, paired, pairedColumns));
  };
  const numericColumns = (overview.tables.find((one) => one.name === 'grasps')?.columns ?? []).filter((name) =>
    !settings.includes(name) && !name.endsWith('.seed') && !['grasp', 'held', 'certified'].includes(name) && new Set(grasps.map((row) => row[name]).filter((x) => typeof x === 'number')).size > 4);
  const drawHistogram = (quantity: string, setting: string) => {
    const rows = grasps.filter((row) => typeof row[quantity] === 'number');
    histograms.replaceChildren(plot(`Histogram of ${quantity}`, setting ? `One row a level of ${setting}.` : '', {
      width: 'container', height: setting ? 90 : 200, mark: { type: 'bar', color: '#0072B2' },
      encoding: { x: { field: escape(quantity), type: 'quantitative', bin: { maxbins: 30 }, title: quantity }, y: { aggregate: 'count', title: 'grasps', axis: { tickMinStep: 1, format: 'd' } },
        ...(setting ? { row: { field: escape(setting), type: 'ordinal', title: setting, header: { labelAngle: 0, labelAlign: 'left' } } } : {}) },
      ...(setting ? { width: 420 } : {}),
    }, rows, ['object', 'hand', ...(setting ? [setting] : []), 'grasp', quantity]));
  };
  const losses = recordsOf(overview, 'losses'), agreement = recordsOf(overview, 'agreement');
  const lost = h('div', { class: 'plots' }), agreed = h('div', { class: 'plots' });
  const drawLosses = () => {
    const columns = overview.tables.find((one) => one.name === 'losses')?.columns ?? [];
    for (const row of losses) {
      row.level = seriesOf(row, settings);
      row.stage = row.best_lost_at || 'held';
    }
    const stages = [...new Set(losses.map((row) => String(row.stage)))];
    lost.append(plot('Where the best grasp is lost', 'Pairs by the stage that lost their best grasp; held: none did.', {
      width: 'container', height: { step: 24 }, mark: 'bar',
      encoding: { y: { field: 'level', type: 'nominal', title: null, sort: null }, x: { field: 'pairs', type: 'quantitative', title: 'pairs', axis: { tickMinStep: 1, format: 'd' } },
        color: { field: 'stage', type: 'nominal', title: null, scale: { domain: stages, range: stages.map((stage, i) => (stage === 'held' ? '#0072B2' : ['#D55E00', '#E69F00', '#CC79A7', '#56B4E9', '#7a7a7a', '#009E73'][i % 6])) } } },
    }, losses, columns));
  };
  const drawAgreement = (setting: string) => drawOver(agreed, agreement, setting, 'Mean over pairs; band and whiskers: bootstrap over objects, where there are several.',
    { value: 'mean', low: 'bootstrap_low', high: 'bootstrap_high', share: false }, ['hand', ...settings, 'objects', 'pairs', 'mean', 'bootstrap_low', 'bootstrap_high']);
  let quantity = numericColumns.find((name) => name === 'score_winding_angle_rad') ?? numericColumns[0] ?? '';
  const level = settings[0] ?? '';
  return {
    title: 'sweep',
    nodes: [
      h('h1', {}, settings.length ? 'Sweep' : 'Distributions'),
      ...(settings.length ? [section('Curves', settings.length > 1 ? h('p', {}, select('over', settings.map((name): [string, string] => [name, name]), level, (name) => {
        drawCurves(name);
        drawAgreement(name);
      })) : null, curves), section('Paired differences', differences),
        ...(losses.length ? [section('Where pairs are lost', lost)] : []),
        ...(agreement.length ? [section('Scores against those of the clean surface', h('p', { class: 'soft' }, 'Rank correlation and overlap of the best tenth: 1 is agreement. Drift: how far the best place moves on the surface.'), agreed)] : [])]
        : [h('p', {}, 'This flow has no [sweep], so there are no curves and no paired differences. ', 'The histograms show how the grasps’ figures are spread.')]),
      section('Histograms', numericColumns.length ? h('p', {}, select('of', numericColumns.map((name): [string, string] => [name, name]), quantity, (value) => {
        quantity = value;
        drawHistogram(value, level);
      })) : h('p', { class: 'soft' }, 'Too few grasps.'), histograms),
    ],
    start: async () => {
      if (level) {
        drawCurves(level);
        drawDifferences();
        if (losses.length) drawLosses();
        if (agreement.length) drawAgreement(level);
      }
      if (quantity) drawHistogram(quantity, level);
    },
  };
}

// ---- run ----

export function runPage(overview: Overview): Page {
  const stages = new Map<string, { made: number; found: number; slots: number }>();
  for (const slot of overview.slots) {
    const one = stages.get(slot.stage) ?? { made: 0, found: 0, slots: 0 };
    one[slot.state === 'hit' ? 'found' : 'made'] += slot.seconds;
    ++one.slots;
    stages.set(slot.stage, one);
  }
  const times = [...stages].flatMap(([stage, one]): Row[] => [{ stage, when: 'this run', seconds: one.made }, { stage, when: 'an earlier run', seconds: one.found }]);
  const plots = h('div', { class: 'plots' });
  const parameters = h('div');
  const slotBox = select('slot', overview.parameters.map((one, i): [string, string] => [String(i), one.slot]), '0', (value) => show(Number(value)));
  const show = (i: number) => {
    const one = overview.parameters[i];
    if (one) parameters.replaceChildren(table(['parameter', 'value', 'set by'], one.values.map(([name, value, from]) => [h('code', {}, name), h('code', {}, value), from === 'default' ? h('span', { class: 'soft' }, from) : h('b', {}, from)]), `parameters of ${one.slot}`));
  };
  show(0);
  return {
    title: 'run',
    nodes: [
      h('h1', {}, 'The run'),
      h('p', { class: 'soft' }, overview.run.map(([name, value]) => `${name} ${value}`).join(' · ')),
      section('Failures', overview.failures.length ? table(['slot', 'kind', 'what', 'see it again with'], overview.failures.map((one) => [one.slot, one.code, one.sentence, h('code', {}, one.command)]), 'failures') : h('p', {}, 'No stage of this run failed.')),
      section('Where the time went', plots),
      section('Parameters, and who set them', overview.parameters.length ? h('p', {}, slotBox) : null, parameters),
      section('Slots', table(['slot', 'state', 'time', 'figures', 'folder'], overview.slots.map((slot) => [slot.slot, slot.state, num('seconds_s', slot.seconds),
        h('span', { class: 'figures-cell' }, Object.entries(slot.metrics).map(([name, value], i) => [i ? '; ' : '', `${name} `, num(`metrics.${name}`, value)])), h('code', {}, slot.folder)]), 'slots')),
      section('The flow', h('pre', { tabindex: 0 }, overview.flow || 'not from a file')),
    ],
    start: async () => append(plots, [plot('Seconds a stage', 'All slots together. Pale: spent in an earlier run, found in the store now.', {
      width: 'container', height: { step: 22 }, mark: 'bar',
      encoding: { y: { field: 'stage', type: 'nominal', sort: null, title: null }, x: { field: 'seconds', type: 'quantitative', title: 'seconds' },
        color: { field: 'when', type: 'nominal', title: null, scale: { domain: ['this run', 'an earlier run'], range: ['#0072B2', '#9db7cc'] } } },
    }, times, ['stage', 'when', 'seconds'])]),
  };
}

export { text };
