import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ballByHops, linksOf } from '../src/ball';
import { colourAt, css, lookUp, oklch, rangeOf, shareOf, type MapName, type Rgb } from '../src/colours';
import { filtered, sorted, type GraspRow } from '../src/grasptable';
import { inOrder, keyAt, linkPoses, poseAt, type HandModel } from '../src/kinematics';
import { digits, text, wilson } from '../src/numbers';
import { csv } from '../src/plot';
import { Vector3 } from 'three';

const near = (a: number, b: number, by: number) => assert.ok(Math.abs(a - b) <= by, `${a} is not ${b} to ${by}`);

test('OKLCh of the screen’s own red, as Ottosson gives it', () => {
  assert.equal(css(oklch(0.62796, 0.2576, 29.234)), '#ff0000');
  assert.equal(css(oklch(1, 0, 0)), '#ffffff');
});

// Lightness of CIE L*a*b* from sRGB (IEC 61966-2-1; CIE 15), independent of the maps' own formulas.
function lightness(rgb: Rgb): number {
  const [r, g, b] = rgb.map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
  const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}
// Machado, Oliveira, Fernandes 2009, severity 1, on linear light.
const deficiencies: Record<string, number[]> = {
  protan: [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  deutan: [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
  tritan: [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.3039],
};
function seen(rgb: Rgb, m: number[]): Rgb {
  const l = rgb.map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
  return [0, 1, 2].map((i) => {
    const x = Math.min(1, Math.max(0, m[3 * i] * l[0] + m[3 * i + 1] * l[1] + m[3 * i + 2] * l[2]));
    return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
  }) as Rgb;
}
for (const map of ['dusk', 'viridis', 'cividis'] as MapName[])
  test(`${map} grows lighter all the way, for every kind of colour vision`, () => {
    const eyes: [string, (rgb: Rgb) => Rgb][] = [['usual', (rgb) => rgb], ...Object.entries(deficiencies).map(([name, m]): [string, (rgb: Rgb) => Rgb] => [name, (rgb) => seen(rgb, m)])];
    for (const [eye, look] of eyes) {
      let before = -1;
      for (let i = 0; i <= 32; ++i) {
        const now = lightness(look(colourAt(map, i / 32)));
        assert.ok(now > before - 0.3, `${eye}: step ${i} goes from ${before} to ${now}`); // 0.3: below a just noticeable difference
        before = now;
      }
    }
  });
test('steps of a map are even to a factor', () => {
  for (const map of ['dusk', 'viridis', 'cividis'] as MapName[]) {
    const steps = Array.from({ length: 16 }, (_, i) => lightness(colourAt(map, (i + 1) / 16)) - lightness(colourAt(map, i / 16)));
    const mean = steps.reduce((a, b) => a + b) / steps.length;
    for (const step of steps) assert.ok(step > 0.3 * mean && step < 2.2 * mean, `${map}: ${step} of ${mean}`);
  }
});
test('the map with two sides is palest in its middle and as dark on both', () => {
  near(lightness(colourAt('balance', 0)), lightness(colourAt('balance', 1)), 12);
  assert.ok(lightness(colourAt('balance', 0.5)) > 90);
  assert.equal(lookUp('balance').length, 256);
});
test('ranges leave the outermost out and are symmetric where the map is', () => {
  const values = Array.from({ length: 1001 }, (_, i) => i);
  values[500] = 1e9;
  const [low, high] = rangeOf(values, 'viridis');
  assert.ok(low >= 4 && low <= 6 && high >= 994 && high <= 996);
  assert.deepEqual(rangeOf([-3, 1, 2], 'balance'), [-3, 3]);
  assert.deepEqual(rangeOf([NaN], 'viridis'), [0, 1]);
  assert.deepEqual(rangeOf([2, 2], 'viridis'), [2, 2]);
  assert.equal(shareOf(2, 2, 2), 0.5);
  assert.equal(shareOf(9, 2, 4), 1);
});

test('Wilson’s interval as Newcombe (1998) prints it', () => {
  for (const [hits, n, low, high] of [[81, 263, 0.2553, 0.3662], [15, 148, 0.0624, 0.1605], [0, 20, 0, 0.1611], [1, 29, 0.0061, 0.1718]]) {
    const rate = wilson(hits, n);
    near(rate.low, low, 5e-5);
    near(rate.high, high, 5e-5);
  }
  assert.deepEqual(wilson(0, 0), { share: 0, low: 0, high: 1 });
});

test('numbers are written with three digits that count', () => {
  assert.equal(digits(9.994), '9.99');
  assert.equal(digits(9.996), '10.0');
  assert.equal(digits(-123.4), '-123');
  assert.equal(text('drift_m', 0.0123), '12.3 mm');
  assert.equal(text('winding_angle_rad', Math.PI), '180°');
  assert.equal(text('wrap_rad.thumb', Math.PI / 2), '90.0°');
  assert.equal(text('share', 0.12345), '12.3 %');
  assert.equal(text('contacts', 6), '6');
  assert.equal(text('epsilon', 0.04711), '0.0471');
  assert.equal(text('x', null), '–');
});
test('copied numbers are RFC 4180', () => {
  assert.equal(csv([{ a: 1.5, b: 'x,"y"' }, { a: null, b: 'z' }], ['a', 'b']), 'a,b\n1.5,"x,""y"""\n,z\n');
});

test('two joints in a plane: the closed form', () => {
  const joint = (parent: number, x: number, dof: number) => ({ parent, child: parent + 1, type: 'revolute' as const, p: [x, 0, 0], q_wxyz: [1, 0, 0, 0], axis: [0, 0, 1], dof, multiplier: 1, offset: 0 });
  const hand: HandModel = { name: 'planar', dofs: ['a', 'b'], open: [0, 0], joints: [joint(0, 0, 0), joint(1, 0.3, 1), { ...joint(2, 0.2, 1), type: 'fixed' }] };
  for (const [a, b] of [[0, 0], [0.4, -1.1], [2, 0.7]]) {
    const tip = new Vector3().applyMatrix4(linkPoses(hand, [a, b])[3]);
    near(tip.x, 0.3 * Math.cos(a) + 0.2 * Math.cos(a + b), 1e-12);
    near(tip.y, 0.3 * Math.sin(a) + 0.2 * Math.sin(a + b), 1e-12);
  }
  const slide: HandModel = { ...hand, joints: [{ ...hand.joints[0], type: 'prismatic', axis: [0, 1, 0], multiplier: -2, offset: 0.1 }] };
  near(new Vector3().applyMatrix4(linkPoses(slide, [0.05, 0])[1]).y, 0, 1e-12);
  assert.deepEqual(inOrder(hand, { b: 3 }), [0, 3]);
});
test('keys of a motion', () => {
  const times = [0, 1, 3];
  assert.deepEqual(keyAt(times, -1), [0, 0]);
  assert.deepEqual(keyAt(times, 2), [1, 0.5]);
  assert.deepEqual(keyAt(times, 9), [2, 0]);
  const half = Math.SQRT1_2;
  const pose = poseAt([0, 1], [[0, 0, 0, 1, 0, 0, 0], [2, 0, 0, half, 0, 0, half]], 0.5);
  near(pose.p.x, 1, 1e-12);
  near(2 * Math.acos(pose.q.w), Math.PI / 4, 1e-9);
});

test('a ball by hops on a torus of squares with one diagonal', () => {
  // Edges go along i, along j and along (1, 1): the hop distance of (di, dj) is max where the signs agree, else the sum of sizes.
  const m = 30, n = 24, faces: number[] = [], at = (i: number, j: number) => ((i + m) % m) * n + ((j + n) % n);
  for (let i = 0; i < m; ++i)
    for (let j = 0; j < n; ++j) faces.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
  const links = linksOf(faces, m * n);
  assert.ok(Array.from({ length: m * n }, (_, v) => links.start[v + 1] - links.start[v]).every((degree) => degree === 6));
  for (const hops of [0, 1, 2, 5]) assert.equal(ballByHops(links, at(3, 4), 0.01 * hops, 0.01).length, 1 + 3 * hops * (hops + 1)); // hexagonal numbers
  assert.equal(ballByHops(links, 0, 1, 0.01).length, m * n);
});

const row = (cells: GraspRow['cells']): GraspRow => ({ cells, pair: 0, grasp: 0, picture: '' });
test('sorting keeps rows without a value last, filtering takes all words', () => {
  const rows = [row({ a: 2, o: 'mug' }), row({ a: null, o: 'ring big' }), row({ a: 10, o: 'ring' })];
  assert.deepEqual(sorted(rows, 'a', false).map((one) => one.cells.a), [2, 10, null]);
  assert.deepEqual(sorted(rows, 'a', true).map((one) => one.cells.a), [10, 2, null]);
  assert.equal(filtered(rows, {}, 'RING big').length, 1);
  assert.equal(filtered(rows, { o: 'ring' }, '').length, 1);
  assert.equal(filtered(rows, { o: '' }, '').length, 3);
});
