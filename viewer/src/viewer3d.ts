// A 3-D view with its controls: what is shown, colours with their legend, section, posture, playback.
import * as data from './data';
import type { Candidate, Details, Grasp, Motion, Pair } from './data';
import { css, colourAt, mapTitles, noValue, type MapName } from './colours';
import { append, button, check, copy, h, save, select, slider } from './dom';
import { num, text } from './numbers';
import { inOrder, keyAt, mix } from './kinematics';
import { recordingsOf } from './recordings';
import type { SceneModule, View } from './scene';

export interface Shown { pair: Pair; details: Details; grasp: Grasp | null; label: string; candidates: boolean }

/** A way, or a trial in which the object moves too. */
type Moving = Motion & { objectX?: number[][]; phase?: string[] };

/** What a link to a view remembers; kept short. */
export type State = URLSearchParams;

export function webgl(): boolean {
  try {
    return document.createElement('canvas').getContext('webgl2') !== null;
  } catch {
    return false;
  }
}

export class Panel {
  readonly element: HTMLElement;
  view: View | null = null;
  onCamera: () => void = () => {};
  private stage = h('div', { class: 'stage' });
  private controls = h('div', { class: 'controls' });
  private legend = h('div', { class: 'legend-box' });
  private told = h('p', { class: 'probe', 'aria-live': 'polite' });
  private stop: () => void = () => {};
  private chosen: Candidate | null = null;
  private ballBox: HTMLSelectElement | null = null;

  constructor(private shown: Shown, private state: State, private changed: () => void) {
    this.element = h('div', { class: 'viewer' }, h('div', { class: 'picture-side' }, this.stage, this.legend, this.told), this.controls);
  }

  dispose(): void {
    this.stop();
    this.view?.dispose();
    this.view = null;
  }

  async start(): Promise<void> {
    const { pair, details, grasp, label } = this.shown;
    if (!webgl()) return this.withoutWebgl();
    this.stage.append(h('p', { class: 'soft wait' }, 'Loading the 3-D view …'));
    const [scene, object, hand] = await Promise.all([
      data.module<SceneModule>('scene'), pair.model ? data.bytes(pair.model) : null,
      grasp && pair.hand_model && grasp.joints_rad && Object.keys(grasp.joints_rad).length ? data.bytes(pair.hand_model) : null,
    ]);
    this.stage.replaceChildren();
    const view = new scene.View(this.stage, details.up, label);
    this.view = view;
    if (object) await view.setObject(object);
    if (hand) await view.setHand(hand);
    this.build(view, grasp);
    view.look();
    const eye = this.state.get('eye');
    if (eye) view.eye = eye.split(',').map(Number);
    view.onCamera = () => {
      this.remember('eye', view.eye.join(','));
      this.onCamera();
    };
    this.stage.dataset.ready = 'yes';
  }

  private withoutWebgl(): void {
    const { pair, grasp, details } = this.shown;
    const index = grasp ? details.grasps.indexOf(grasp) : -1;
    const small = index >= 0 ? pair.pictures?.[index] : undefined;
    this.stage.classList.add('flat');
    append(this.stage, [
      h('p', {}, 'This browser has no WebGL, so there is no 3-D view. The pictures were drawn without it.'),
      small ? h('img', { src: data.picture(small), alt: `grasp ${index + 1}`, width: 320, height: 240 }) : null,
      pair.figures.map((figure) => h('img', { src: data.picture(figure.file), alt: figure.title, width: 320, height: 240 })),
    ]);
    this.stage.dataset.ready = 'flat';
  }

  private remember(key: string, value: string | null): void {
    if (value === null || value === '') this.state.delete(key);
    else this.state.set(key, value);
    this.changed();
  }

  private build(view: View, grasp: Grasp | null): void {
    const groups: HTMLElement[] = [this.colourControls(view), this.partControls(view, grasp), this.sectionControls(view)];
    if (grasp && view.hand) groups.push(...this.handControls(view, grasp));
    if (this.shown.details.candidates.length) groups.push(this.ballControls(view, grasp));
    groups.push(this.fileControls(view));
    append(this.controls, groups);
    view.onProbe = (probe) => {
      this.told.replaceChildren();
      if (probe)
        append(this.told, [`Vertex ${probe.vertex}: `, probe.fields.map((field, i) => [i ? ', ' : '', field.title, ' ',
          h('b', { class: 'probed' }, text(field.name, Number.isNaN(field.value) ? null : field.value))])]);
    };
  }

  private group(title: string, ...children: (Node | null)[]): HTMLElement {
    return h('fieldset', {}, h('legend', {}, title), children);
  }

  private colourControls(view: View): HTMLElement {
    const fields: [string, string][] = view.fields.map((field) => [field.name, field.title]);
    let field = this.state.get('field') ?? fields[0]?.[0] ?? '';
    const usual = (name: string): MapName => (/curvature|defect/.test(name) ? 'balance' : 'dusk');
    let map = (this.state.get('map') as MapName | null) ?? usual(field);
    if (!(map in mapTitles)) map = usual(field);
    const maps = select('colours', Object.entries(mapTitles), map, (value) => {
      map = value as MapName;
      this.remember('map', value);
      paint();
    });
    const paint = () => this.showLegend(field, map, view.colour(field, map), view);
    const what = select('surface', [...fields, ['', 'plain']], field, (value) => {
      field = value;
      map = usual(field);
      (maps.querySelector('select') as HTMLSelectElement).value = map;
      this.remember('field', value);
      this.remember('map', null);
      paint();
    });
    paint();
    return this.group('Colour', what, maps);
  }

  private showLegend(name: string, map: MapName, [low, high]: [number, number], view: View): void {
    const field = view.fields.find((one) => one.name === name);
    this.legend.replaceChildren();
    if (!field) return;
    const stops = Array.from({ length: 17 }, (_, i) => css(colourAt(map, i / 16))).join(',');
    const none = field.values.some(Number.isNaN);
    append(this.legend, low === high ? [h('span', { class: 'legend-title' }, field.title), h('span', { class: 'legend-end' }, `${text(name, low)} everywhere`)] : [
      h('span', { class: 'legend-title' }, field.title),
      h('span', { class: 'legend-end' }, text(name, low)),
      h('span', { class: 'legend-bar', style: `background:linear-gradient(90deg,${stops})`, role: 'img', 'aria-label': `colour scale ${mapTitles[map]}` }),
      h('span', { class: 'legend-end' }, text(name, high)),
      none ? [h('span', { class: 'swatch', style: `background:${css(noValue)}` }), h('span', {}, 'no dominant axis')] : null,
    ]);
  }

  private partControls(view: View, grasp: Grasp | null): HTMLElement {
    const usual = view.fields.length === 0 ? 'hand,contacts,cloud' : this.shown.candidates ? 'hand,contacts,candidates' : 'hand,contacts';
    const on = new Set((this.state.get('show') ?? usual).split(','));
    const part = (name: 'hand' | 'cloud' | 'voxels' | 'candidates' | 'contacts' | 'edges', title: string, hint: string) => {
      view.show(name, on.has(name));
      return check(title, on.has(name), (value) => {
        if (value) on.add(name);
        else on.delete(name);
        view.show(name, value);
        this.remember('show', [...on].filter(Boolean).join(',') || 'none');
      }, hint);
    };
    view.setCandidates(this.shown.details.candidates);
    view.setContacts(grasp?.contacts ?? []);
    return this.group('Show',
      grasp && view.hand ? part('hand', 'hand', 'the hand’s capsules: what closing, planning and physics see') : null,
      grasp?.contacts?.length ? part('contacts', 'contacts', 'where links touch; arrows push inwards') : null,
      this.shown.details.candidates.length === 0 ? null : part('candidates', 'candidates', 'places that were proposed; white: winding, green: curvature'),
      view.has('cloud') ? part('cloud', 'scan points', 'what the sensor saw') : null,
      view.has('voxels') ? part('voxels', 'occupied cells', 'cells of the occupancy map where rays ended') : null,
      part('edges', 'mesh edges', ''),
      grasp && view.hand ? check('see-through hand', this.state.get('glass') === '1', (value) => {
        view.handOpacity(value ? 0.35 : 1);
        this.remember('glass', value ? '1' : null);
      }) : null);
  }

  private sectionControls(view: View): HTMLElement {
    const [start, at] = (this.state.get('cut') ?? 'none:0.5').split(':');
    let axis = (['x', 'y', 'z'].includes(start) ? start : 'none') as 'none' | 'x' | 'y' | 'z', share = Number(at) || 0.5;
    const apply = (keep = true) => {
      view.section(axis === 'none' ? null : axis, share);
      bar.box.disabled = axis === 'none';
      if (keep) this.remember('cut', axis === 'none' ? null : `${axis}:${share}`);
    };
    const bar = slider('where', 0, 1, 0.01, share, (value) => {
      share = value;
      apply();
    });
    const box = select('plane across', [['none', 'none'], ['x', 'x'], ['y', 'y'], ['z', 'z']], axis, (value) => {
      axis = value as typeof axis;
      apply();
    });
    apply(false);
    return this.group('Section', box, bar.label);
  }

  private handControls(view: View, grasp: Grasp): HTMLElement[] {
    const hand = view.hand!;
    const closed = inOrder(hand, grasp.joints_rad), open = inOrder(hand, grasp.pregrasp_joints_rad);
    const rest = () => {
      view.placeHand(grasp.X_OH.p_m, grasp.X_OH.q_wxyz);
      view.placeObject(null);
    };
    const close = (share: number) => view.posture(mix(open, closed, share));
    rest();
    const posture = Number(this.state.get('closed') ?? 1);
    close(posture);
    if (this.state.get('glass') === '1') view.handOpacity(0.35);
    const bar = slider('open – closed', 0, 1, 0.01, posture, (value) => {
      this.stop();
      rest();
      close(value);
      this.remember('closed', value === 1 ? null : String(value));
    });
    const groups = [this.group('Posture', bar.label)];
    const motions: [string, Moving][] = [];
    if (grasp.approach && grasp.approach.times_s.length > 1) motions.push(['the way to the grasp', grasp.approach]);
    for (const recording of recordingsOf(grasp)) motions.push([recording.title, recording]);
    if (motions.length) groups.push(this.playControls(view, motions, () => {
      rest();
      close(1);
      bar.box.value = '1';
    }));
    return groups;
  }

  private playControls(view: View, motions: [string, Moving][], rest: () => void): HTMLElement {
    let [, motion] = motions[0];
    let time = 0, playing = false, before = 0, frame = 0;
    const end = () => motion.times_s[motion.times_s.length - 1];
    const readout = h('output', { class: 'time' });
    const pose = () => {
      view.pose(motion, time);
      if (motion.objectX) view.poseObject(motion.times_s, motion.objectX, time);
      bar.box.value = String(time / end());
      const phase = motion.phase?.[keyAt(motion.times_s, time)[0]];
      readout.textContent = `${time.toFixed(2)} of ${end().toFixed(2)} s${phase ? ', ' + phase : ''}`;
    };
    const step = (now: number) => {
      if (!playing) return;
      time += Math.min(0.1, (now - before) / 1000);
      before = now;
      if (time >= end()) {
        time = end();
        pause();
      }
      pose();
      if (playing) frame = requestAnimationFrame(step);
    };
    const pause = () => {
      playing = false;
      cancelAnimationFrame(frame);
      play.textContent = 'Play';
    };
    const start = () => {
      if (time >= end()) time = 0;
      playing = true;
      before = performance.now();
      play.textContent = 'Pause';
      frame = requestAnimationFrame(step);
    };
    this.stop = pause;
    const play = button('Play', () => (playing ? pause() : start()), { class: 'play' });
    const bar = slider('time', 0, 1, 0.001, 0, (value) => {
      pause();
      time = value * end();
      pose();
    });
    this.stage.addEventListener('keydown', (event) => {
      if (event.key !== ' ') return;
      event.preventDefault();
      if (playing) pause();
      else start();
    });
    const which = motions.length > 1 ? select('play', motions.map(([name], i) => [String(i), name]), '0', (value) => {
      pause();
      motion = motions[Number(value)][1];
      time = 0;
      rest();
      pose();
    }) : null;
    return this.group(motions.length > 1 ? 'Playback' : `Playback: ${motions[0][0]}`, which,
      h('div', { class: 'row' }, play, button('Rest', () => {
        pause();
        rest();
      }), readout), bar.label);
  }

  private ballControls(view: View, grasp: Grasp | null): HTMLElement {
    const { candidates } = this.shown.details;
    const own = grasp?.scores.candidate;
    const note = h('p', { class: 'soft small' });
    const choose = (value: string, keep = true) => {
      this.chosen = value === '' ? null : candidates[Number(value)] ?? null;
      const shown = view.showBall(this.chosen);
      note.replaceChildren();
      if (this.chosen && shown) this.element.dataset.ballAgrees = shown.vertices === this.chosen.ball.vertices ? 'yes' : 'no';
      if (this.chosen && shown)
        append(note, ['blue: principal axis A and the plane across it; red: the path that winds, ',
          num('winding_angle_rad', this.chosen.winding_angle_rad), '; curvature ', num('curvature_sum_rad', this.chosen.curvature_sum_rad),
          '; ', num('vertices', this.chosen.ball.vertices), ' vertices']);
      if (keep) this.remember('ball', value);
      if (this.ballBox && this.ballBox.value !== value) this.ballBox.value = value;
    };
    const start = this.state.get('ball') ?? '';
    const options: [string, string][] = [['', 'none'], ...candidates.map((one, i): [string, string] =>
      [String(i), `${one.heuristic} ${i + 1}${i === own ? ' (of this grasp)' : ''}`])];
    const box = select('around candidate', options, start, (value) => choose(value));
    this.ballBox = box.querySelector('select');
    view.onCandidate = (index) => choose(String(index));
    if (start) choose(start, false);
    return this.group('Geodesic ball', box,
      own !== undefined && own !== null ? button('ball of this grasp', () => choose(String(own)), { class: 'own-ball' }) : null, note);
  }

  private fileControls(view: View): HTMLElement {
    const name = this.shown.label.replace(/[^\w.-]+/g, '_');
    const link = button('Copy link to this view', async () => {
      this.remember('eye', view.eye.join(','));
      await copy(location.href);
      link.textContent = 'Copied';
      setTimeout(() => (link.textContent = 'Copy link to this view'), 1500);
    });
    return this.group('Keep', link,
      button('Save glTF', async () => save(`${name}.glb`, await view.glb(), 'model/gltf-binary')),
      button('Save picture', () => h('a', { href: view.picture(), download: `${name}.png` }).click()),
      button('Reset view', () => {
        view.look();
        this.remember('eye', null);
      }),
      h('details', {}, h('summary', {}, 'Keys'), h('p', { class: 'small' },
        'Drag to turn, wheel or pinch to zoom, right drag to move. With the picture focused: arrows turn, + and − zoom, 0 resets, space plays. A click on the surface reads its values, a click on a candidate shows its ball.')));
  }
}
