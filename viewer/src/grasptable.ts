// The table of grasps: filter, sort, choose two to compare. A row of results.csv each.
import { picture, type Cell, type Overview, type Table } from './data';
import { button, h, select } from './dom';
import { num, wilson } from './numbers';

export interface GraspRow { cells: Record<string, Cell>; pair: number; grasp: number | null; picture: string }

export function graspRows(overview: Overview): GraspRow[] {
  const grasps = overview.tables.find((one) => one.name === 'grasps');
  if (!grasps) return [];
  const pairs = new Map(overview.pairs.map((pair, i) => [`${pair.object}|${pair.hand}`, i]));
  return grasps.rows.map((row) => {
    const cells = Object.fromEntries(grasps.columns.map((name, i) => [name, row[i]]));
    const pair = pairs.get(`${cells.object}${cells.variant ?? ''}|${cells.hand}`) ?? -1;
    const grasp = typeof cells.grasp === 'number' ? cells.grasp : null;
    return { cells, pair, grasp, picture: grasp !== null && pair >= 0 ? overview.pairs[pair].pictures?.[grasp] ?? '' : '' };
  });
}

/** Columns that are shown where some row has them: name, title. */
export function shownColumns(grasps: Table | undefined): [string, string][] {
  const swept = (grasps?.columns ?? []).filter((name) => name.includes('.') && !/^(score|cage)_/.test(name)).map((name): [string, string] => [name, name]);
  const wanted: [string, string][] = [
    ['object', 'object'], ['hand', 'hand'], ...swept, ['grasp', 'grasp'], ['outcome', 'force test'],
    ['cage_outcome', 'cage test'], ['heuristic', 'heuristic'], ['score_rank', 'rank'],
    ['score_winding_angle_rad', 'S1 winding'], ['score_curvature_sum_rad', 'S2 curvature'], ['score_blocked_share', 'blocked'],
    ['score_contacts', 'contacts'], ['force_closure', 'force closure'], ['score_ferrari_canny_low', 'epsilon ≥'],
    ['approach_outcome', 'approach'], ['min_clearance_m', 'clearance'], ['directions_held', 'pushes held'], ['reason', 'why'],
  ];
  return wanted.filter(([name]) => {
    const at = grasps?.columns.indexOf(name) ?? -1;
    return at >= 0 && grasps!.rows.some((row) => row[at] !== null && row[at] !== '');
  });
}

const compare = (a: Cell, b: Cell): number =>
  a === null || a === '' ? (b === null || b === '' ? 0 : 1) : b === null || b === '' ? -1
    : typeof a === 'number' && typeof b === 'number' ? a - b : String(a).localeCompare(String(b), undefined, { numeric: true });

/** Sorted copy; rows without a value stay last, whichever way round. */
export function sorted(rows: GraspRow[], column: string, down: boolean): GraspRow[] {
  return [...rows].sort((a, b) => {
    const x = a.cells[column] ?? null, y = b.cells[column] ?? null, order = compare(x, y);
    return x === null || x === '' || y === null || y === '' ? order : down ? -order : order;
  });
}

export function filtered(rows: GraspRow[], chosen: Record<string, string>, words: string): GraspRow[] {
  const terms = words.toLowerCase().split(/\s+/).filter(Boolean);
  return rows.filter((row) => Object.entries(chosen).every(([name, value]) => value === '' || String(row.cells[name] ?? '–') === value)
    && terms.every((term) => Object.values(row.cells).some((cell) => String(cell ?? '').toLowerCase().includes(term))));
}

export function badge(outcome: string): HTMLElement {
  return h('span', { class: `badge ${outcome.replace(/\W/g, '_')}` }, outcome);
}

const page = 60;

export function graspTable(overview: Overview, rows: GraspRow[]): HTMLElement {
  const columns = shownColumns(overview.tables.find((one) => one.name === 'grasps'));
  const chosen: Record<string, string> = {};
  let words = '', column = '', down = false, most = page;
  const picked = new Set<GraspRow>();
  const body = h('tbody'), told = h('p', { class: 'soft', 'aria-live': 'polite', id: 'shown-rows' }), more = button('', () => {
    most += 10 * page;
    fill();
  });
  const both = button('Compare two chosen grasps', () => {
    const [a, b] = [...picked];
    location.hash = `#compare/${a.pair}/${a.grasp}/${b.pair}/${b.grasp}`;
  }, { disabled: true, class: 'compare' });

  const cellOf = (row: GraspRow, name: string): Node | string => {
    const value = row.cells[name] ?? null;
    if (name === 'object') return h('a', { href: `#object/${encodeURIComponent(String(value))}` }, String(value));
    if (name === 'grasp' && row.grasp !== null) return h('a', { href: `#grasp/${row.pair}/${row.grasp}` }, String(row.grasp + 1));
    if (name === 'outcome' || name === 'cage_outcome') return value ? badge(String(value)) : String(row.cells.pair_outcome === 'done' || name === 'cage_outcome' ? '–' : row.cells.pair_outcome);
    if (name === 'reason') return String(value || row.cells.sentence || '–');
    if (typeof value === 'number') return num(name.replace(/^score_/, ''), value);
    return value === null || value === '' ? '–' : String(value);
  };
  const line = (row: GraspRow) => {
    const tick = row.grasp === null ? null : h('input', { type: 'checkbox', 'aria-label': `choose ${row.cells.object} ${row.cells.hand} grasp ${row.grasp + 1}`, onchange: () => {
      if (picked.has(row)) picked.delete(row);
      else picked.add(row);
      both.disabled = picked.size !== 2;
    } });
    if (tick && picked.has(row)) tick.checked = true;
    const small = row.picture ? h('a', { href: `#grasp/${row.pair}/${row.grasp}`, 'aria-label': `grasp ${Number(row.grasp) + 1} of ${row.cells.object}` },
      h('img', { src: picture(row.picture), alt: '', width: 96, height: 72, loading: 'lazy' })) : null;
    return h('tr', {}, h('td', {}, tick), h('td', { class: 'thumb' }, small), columns.map(([name]) => h('td', { class: name === 'reason' ? 'text' : null }, cellOf(row, name))));
  };
  const heads = columns.map(([name, title]) => {
    const head = h('th', { scope: 'col' }, button(title, () => {
      down = column === name ? !down : /^score_|held|clearance/.test(name);
      column = name;
      for (const one of heads) one.removeAttribute('aria-sort');
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      fill();
    }, { class: 'sort', title: `sort by ${name}` }));
    return head;
  });
  const fill = () => {
    const found = filtered(rows, chosen, words);
    const shown = column ? sorted(found, column, down) : found;
    body.replaceChildren(...shown.slice(0, most).map(line));
    const held = found.filter((row) => row.cells.held === 1).length, rate = wilson(held, found.length);
    told.textContent = `${found.length} of ${rows.length} rows; ${held} held` +
      (found.length ? `: ${(100 * rate.share).toFixed(1)} % (95 % interval ${(100 * rate.low).toFixed(1)} to ${(100 * rate.high).toFixed(1)} %)` : '');
    more.hidden = shown.length <= most;
    more.textContent = `Show more (${shown.length - most} left)`;
  };
  const filters = [['object', 'object'], ['hand', 'hand'], ['heuristic', 'heuristic'], ['outcome', 'force test'], ['cage_outcome', 'cage test']]
    .map(([name, title]) => {
      const values = [...new Set(rows.map((row) => String(row.cells[name] ?? '–')))].sort((a, b) => a.localeCompare(b, undefined, { numeric: true }));
      return values.length < 2 ? null : select(title, [['', 'all'], ...values.map((value): [string, string] => [value, value || '–'])], '', (value) => {
        chosen[name] = value;
        fill();
      });
    });
  const search = h('input', { type: 'search', placeholder: 'any words', oninput: () => {
    words = search.value;
    fill();
  } });
  fill();
  return h('div', { class: 'grasp-table' },
    h('div', { class: 'filters' }, h('label', {}, 'find ', search), filters, both), told,
    h('div', { class: 'wide', tabindex: 0, role: 'region', 'aria-label': 'grasps' }, h('table', {},
      h('thead', {}, h('tr', {}, h('td', {}, ''), h('td', {}, ''), heads)), body)), more);
}
