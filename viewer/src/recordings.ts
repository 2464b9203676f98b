// Trials of the physics tests as motions that can be played.
import type { Grasp, Motion } from './data';

export interface Played { title: string; motion: Motion & { objectX?: number[][] } }

export function recordingsOf(_grasp: Grasp): Played[] {
  return [];
}
