// The models of a small run, read by others: Khronos' own validator, and three.js' loader; hands stand where contacts say.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { inflateSync } from 'node:zlib';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { Mesh, Object3D, Quaternion, Vector3 } from 'three';
// @ts-expect-error: it has no types
import { validateBytes } from 'gltf-validator';
import { ballByHops, linksOf } from '../src/ball';
import { inOrder, jointPose, type HandModel } from '../src/kinematics';
import type { Details, Overview } from '../src/data';

const folder = process.env.GEOCAGE_SMALL_RUN!;
const data = join(folder, 'report', 'data');
const unpacked = (name: string): Buffer => {
  const text = readFileSync(join(data, `${name}.js`), 'utf8');
  return inflateSync(Buffer.from(/^geocage\.put\("[^"]+","([^"]*)"\);\n$/.exec(text)![1], 'base64'));
};
const document = <T>(name: string): T => JSON.parse(unpacked(name).toString()) as T;
const parsed = (bytes: Buffer) => new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length) as ArrayBuffer, '');
const overview = document<Overview>('overview');
const pair = overview.pairs.find((one) => one.details && one.pictures?.length)!;
const details = document<Details>(pair.details!);

test('Khronos’ validator finds no error in any model', async () => {
  const files: [string, Buffer][] = readdirSync(data).filter((name) => /^(object|hand)-/.test(name)).map((name) => [name, unpacked(name.replace(/\.js$/, ''))]);
  try {
    for (const name of readdirSync(join(folder, 'view')).filter((one) => one.endsWith('.glb'))) files.push([name, readFileSync(join(folder, 'view', name))]);
  } catch {
    // `geocage view` was not tested before
  }
  assert.ok(files.length >= 2);
  for (const [name, bytes] of files) {
    const report = await validateBytes(new Uint8Array(bytes));
    assert.equal(report.issues.numErrors, 0, `${name}: ${JSON.stringify(report.issues.messages.slice(0, 4))}`);
  }
});

interface Ply { positions: number[][]; winding: number[]; ball: number[]; faces: number[] }
/** scores.ply of the artefact: binary little-endian, doubles, as its header says. */
function artefact(): Ply {
  const run = JSON.parse(readFileSync(join(folder, 'run.json'), 'utf8'));
  const slot = run.slots.find((one: { slot: string }) => one.slot === `${pair.object}/score/${pair.hand}`);
  const bytes = readFileSync(join(folder, slot.folder, 'scores.ply'));
  const end = bytes.indexOf('end_header\n') + 11, head = bytes.subarray(0, end).toString();
  const count = Number(/element vertex (\d+)/.exec(head)![1]), faceCount = Number(/element face (\d+)/.exec(head)![1]);
  const columns = [...head.slice(0, head.indexOf('element face')).matchAll(/property (\w+) (\w+)/g)].map((one) => [one[1], one[2]]);
  assert.ok(columns.every(([type]) => type === 'double'), 'all columns are doubles');
  const all: Ply = { positions: [], winding: [], ball: [], faces: [] }, at = (name: string) => columns.findIndex((one) => one[1] === name);
  let here = end;
  for (let v = 0; v < count; ++v, here += 8 * columns.length) {
    const x = (k: number) => bytes.readDoubleLE(here + 8 * k);
    all.positions.push([x(0), x(1), x(2)]);
    all.winding.push(x(at('winding_angle_rad')));
    all.ball.push(x(at('ball_vertices')));
  }
  for (let f = 0; f < faceCount; ++f, here += 13) for (let k = 0; k < 3; ++k) all.faces.push(bytes.readInt32LE(here + 1 + 4 * k));
  return all;
}

test('an object’s model is the artefact’s mesh, to half a step of its sixteen bits', async () => {
  const ply = artefact(), file = await parsed(unpacked(pair.model));
  file.scene.updateMatrixWorld(true);
  let mesh: Mesh | null = null;
  file.scene.traverse((node) => {
    if (node instanceof Mesh) mesh = node;
  });
  const surface = mesh! as Mesh, places = surface.geometry.getAttribute('position');
  assert.equal(places.count, ply.positions.length);
  const size = Math.max(...[0, 1, 2].map((k) => Math.max(...ply.positions.map((p) => p[k])) - Math.min(...ply.positions.map((p) => p[k]))));
  const fields = (surface.geometry.userData.fields ?? surface.userData.fields) as { name: string; attribute: string; low: number; high: number }[];
  const field = fields.find((one) => one.name === 'winding_angle_rad')!, codes = surface.geometry.getAttribute(field.attribute.toLowerCase());
  for (let v = 0; v < places.count; ++v) {
    const p = new Vector3().fromBufferAttribute(places, v).applyMatrix4(surface.matrixWorld);
    // Half a step on each axis; 1e-7: three.js multiplies in 64 bits what the file holds in text.
    [p.x, p.y, p.z].forEach((x, k) => assert.ok(Math.abs(x - ply.positions[v][k]) <= (0.5 * size) / 65535 + 1e-7));
    const code = codes.getX(v);
    if (Number.isNaN(ply.winding[v])) assert.equal(code, 65535);
    else assert.ok(Math.abs(field.low + ((field.high - field.low) * code) / 65534 - ply.winding[v]) <= (0.5001 * (field.high - field.low)) / 65534);
  }
  assert.deepEqual([...surface.geometry.index!.array], ply.faces);
});

test('balls by hops have as many vertices as the artefact says', () => {
  const ply = artefact(), links = linksOf(ply.faces, ply.positions.length);
  let sum = 0, edges = 0;
  for (let v = 0; v < ply.positions.length; ++v)
    for (let i = links.start[v]; i < links.start[v + 1]; ++i)
      if (links.items[i] > v) {
        sum += Math.hypot(...ply.positions[v].map((x, k) => x - ply.positions[links.items[i]][k]));
        ++edges;
      }
  for (let v = 0; v < ply.positions.length; v += 37)
    assert.equal(ballByHops(links, v, details.grasps[0].scores.ball_radius_m as number, sum / edges).length, ply.ball[v]);
});

test('the posed hand is where its contacts are', async () => {
  const file = await parsed(unpacked(pair.hand_model!));
  let hand: HandModel | null = null;
  const links: Object3D[] = [], meshes: Mesh[] = [];
  file.scene.traverse((node) => {
    if (node.userData.kind === 'hand') hand = node.userData as unknown as HandModel;
    if (typeof node.userData.link === 'number') links[node.userData.link] = node;
    if (node instanceof Mesh) meshes.push(node);
  });
  for (const grasp of details.grasps) {
    assert.ok(grasp.contacts!.length > 0);
    const q = inOrder(hand!, grasp.joints_rad);
    for (const joint of hand!.joints) jointPose(joint, q).decompose(links[joint.child].position, links[joint.child].quaternion, links[joint.child].scale);
    const [w, x, y, z] = grasp.X_OH.q_wxyz;
    file.scene.position.set(...(grasp.X_OH.p_m as [number, number, number]));
    file.scene.quaternion.copy(new Quaternion(x, y, z, w));
    file.scene.updateMatrixWorld(true);
    for (const contact of grasp.contacts!) {
      const p = new Vector3(...(contact.p as [number, number, number]));
      let least = Infinity;
      for (const mesh of meshes) {
        const places = mesh.geometry.getAttribute('position');
        const index = mesh.geometry.index!;
        const corner = (i: number) => new Vector3().fromBufferAttribute(places, index.getX(i)).applyMatrix4(mesh.matrixWorld);
        for (let i = 0; i < index.count; i += 3) {
          const a = corner(i), b = corner(i + 1), c = corner(i + 2);
          // The nearest of a dozen points of each triangle: capsule triangles are long and thin.
          for (let s = 0; s <= 12; ++s)
            for (const [from, to] of [[a, b], [b, c], [c, a]]) least = Math.min(least, p.distanceTo(from.clone().lerp(to, s / 12)));
        }
      }
      // 2.5 mm count as contact; a facet of 14 around lies 2.5 % of its radius (at most 25 mm) inside; samples are up to 4 mm apart across.
      assert.ok(least < 0.0055, `${contact.link}: ${least} m`);
    }
  }
});
