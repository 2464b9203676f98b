// Trials of the physics tests as motions that can be played: hand and object move in the world W, which is O at the start.
import type { Grasp, Motion } from './data';

export interface Played extends Motion { title: string; objectX: number[][]; phase: string[] }

export function recordingsOf(grasp: Grasp): Played[] {
  return (grasp.recordings ?? []).filter((one) => one.times_s.length > 1).map((one) => {
    const whole = (rows: number[][]) => (rows.length === 1 ? one.times_s.map(() => rows[0]) : rows);
    return {
      title: `${one.protocol === 'geocage-cage' ? 'cage' : 'force'}: ${one.trial} (${one.outcome})`, times_s: one.times_s, joints: one.joints,
      q: whole(one.q), X: whole(one.X_WH), objectX: one.X_WO, phase: one.phase,
    };
  });
}
