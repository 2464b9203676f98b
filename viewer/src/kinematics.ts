// Poses of a hand's links from its joints: X_PC = X_PJ * motion(axis, multiplier * q + offset), as hands/kinematics.h has it.
import { Matrix4, Quaternion, Vector3 } from 'three';

export interface Joint {
  parent: number; child: number; type: 'fixed' | 'revolute' | 'prismatic'; p: number[]; q_wxyz: number[]; axis: number[];
  dof: number; multiplier: number; offset: number;
}
export interface HandModel { name: string; dofs: string[]; open: number[]; joints: Joint[] }

/** X_PL of the child link of a joint. */
export function jointPose(joint: Joint, q: ArrayLike<number>): Matrix4 {
  const [w, x, y, z] = joint.q_wxyz;
  const fixed = new Matrix4().compose(new Vector3(...joint.p), new Quaternion(x, y, z, w), new Vector3(1, 1, 1));
  if (joint.type === 'fixed') return fixed;
  const value = joint.multiplier * q[joint.dof] + joint.offset, axis = new Vector3(...joint.axis);
  const motion = joint.type === 'revolute' ? new Matrix4().makeRotationAxis(axis.normalize(), value)
    : new Matrix4().makeTranslation(axis.multiplyScalar(value));
  return fixed.multiply(motion);
}

/** X_HL of every link; parents come first. */
export function linkPoses(hand: HandModel, q: ArrayLike<number>): Matrix4[] {
  const poses = [new Matrix4()];
  for (const joint of hand.joints) poses[joint.child] = poses[joint.parent].clone().multiply(jointPose(joint, q));
  return poses;
}

/** Joint values in the hand's order; `otherwise` where a name is not there. */
export function inOrder(hand: { dofs: string[]; open: number[] }, joints: Record<string, number> | undefined): number[] {
  return hand.dofs.map((name, i) => joints?.[name] ?? hand.open[i]);
}

export const mix = (a: ArrayLike<number>, b: ArrayLike<number>, t: number): number[] =>
  Array.from(a, (x, i) => x + (b[i] - x) * t);

/** A pose [x, y, z, qw, qx, qy, qz] at a time between keys. */
export function poseAt(times: number[], X: number[][], time: number): { p: Vector3; q: Quaternion } {
  const [i, t] = keyAt(times, time);
  const a = X[i], b = X[Math.min(i + 1, X.length - 1)];
  const q = (c: number[]) => new Quaternion(c[4], c[5], c[6], c[3]);
  return { p: new Vector3(a[0], a[1], a[2]).lerp(new Vector3(b[0], b[1], b[2]), t), q: q(a).slerp(q(b), t) };
}

/** The key before a time, and how far it is to the next one, 0..1. */
export function keyAt(times: number[], time: number): [number, number] {
  let low = 0, high = times.length - 1;
  if (high <= 0 || time <= times[0]) return [0, 0];
  if (time >= times[high]) return [high, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return [low, (time - times[low]) / (times[high] - times[low])];
}
