// What the report's files hold, and how they arrive. A page that was opened from disk may not fetch; so data files are scripts
// that call geocage.put(name, text), text being base64 of zlib. In a single file they are <script type="text/plain" data-file>.

export type Cell = number | string | null;
export interface Table { name: string; columns: string[]; rows: Cell[][] }
export interface Figure { file: string; title: string }
export interface Pair {
  object: string; base: string; hand: string; outcome: string; sentence: string; source: string; truth_known: boolean;
  levels: [string, string][]; model: string; hand_model?: string; details?: string; figures: Figure[]; pictures?: string[];
}
export interface Slot {
  slot: string; stage: string; state: string; seconds: number; folder: string; sentence: string; metrics: Record<string, number>;
}
export interface Success { by: string; value: Cell; held: number; rows: number; share: number; low: number; high: number }
export interface Overview {
  schema: string; title: string; counts: Record<'in' | 'done' | 'failed' | 'rejected' | 'skipped', number>;
  run: [string, string][]; flow: string; hands: { name: string; model: string; dofs: string[] }[]; pairs: Pair[]; slots: Slot[];
  parameters: { slot: string; values: [string, string, string][] }[];
  failures: { slot: string; code: string; sentence: string; command: string }[];
  tables: Table[]; success: Success[];
}
export interface Direction {
  name: string; held: boolean; held_within_2_cm?: boolean; outcome?: string; max_displacement_m: number | null; max_rotation_rad: number | null; ended_s?: number;
}
/** A motion that can be played: poses of the hand in O, or (of physics) of the object in the hand's world. */
export interface Motion { times_s: number[]; joints: string[]; q: number[][]; X: number[][] }
export interface Approach extends Motion {
  outcome?: string; planner?: string; dt_s: number; seconds: number; min_clearance_m: number | null; certified: boolean;
}
export interface Evaluation {
  outcome: string; reason: string; drift_m?: number | null; drift_rad?: number | null; directions: Direction[];
  start_penetration_m?: number; max_penetration_m?: number; ring?: Direction[]; compliant?: Direction[];
  wrenches?: { amplitude_weights: number; trials: number; lost: number; errors?: number; survival?: number; mean_held_s?: number; curve_s_share?: [number, number][] }[];
  summary?: { pushes: number; held: number; held_share: number; held_within_2_cm: number; worst: string | null; fall_s: number | null };
  a_50?: { is: string; weights: number } | null;
  escape_search?: { result: string; found?: number; seeds?: number; rise_m?: number[]; unfound_rise_m?: number[]; [key: string]: unknown };
}
/** A trial as it went, from geocage-recording 1; a list of one row never changes. Poses are x y z, qw qx qy qz in the world W. */
export interface Recording {
  trial: string; outcome: string; protocol: string; joints: string[]; times_s: number[]; X_WH: number[][]; X_WO: number[][]; q: number[][]; phase: string[];
}
export interface Grasp {
  hand: string; object: string; heuristic?: string; X_OH: { p_m: number[]; q_wxyz: number[] };
  joints_rad?: Record<string, number>; pregrasp_joints_rad?: Record<string, number>; points_m?: number[][];
  scores: Record<string, number | null>; force_closure?: string; approach: Approach | null; evaluation?: Evaluation; cage?: Evaluation;
  contacts?: { link: string; p: number[]; n: number[] }[]; recordings?: Recording[];
}
export interface Control { name: string; rule: string; grasps: number; trials: number; held: number; passed: number; ok: boolean }
export interface TestHead { protocol: string; object_geometry: string; controls: Control[]; valid?: boolean; engine?: Record<string, Cell> }
export interface Candidate {
  vertex: number; heuristic: string; score: number; radius_m: number; winding_angle_rad: number | null; curvature_sum_rad: number;
  euler: number; p_m: number[]; normal: number[]; center_m: number[]; axis: number[];
  ball: { path: number[][]; closed: boolean; vertices: number; center?: number[]; axis?: number[] };
}
export interface Details {
  up: [number, number, number]; evaluation: TestHead | null; cage: TestHead | null; candidates: Candidate[]; grasps: Grasp[];
  rejected: Record<string, number>; metric: string;
}

const texts = new Map<string, string>();
const modules = new Map<string, unknown>();
const arrivals = new Map<string, Promise<void>>();

export function install(): void {
  (window as unknown as { geocage: unknown }).geocage = {
    put: (name: string, text: string) => texts.set(name, text),
    module: (name: string, api: unknown) => modules.set(name, api),
  };
}

export function inlined(file: string): string | null {
  return document.querySelector(`script[data-file="${CSS.escape(file)}"]`)?.textContent ?? null;
}

/** The address of a picture: a file beside the page, or the data that a single file holds. */
export function picture(file: string): string {
  return inlined(file) ?? file;
}

function arrive(file: string): Promise<void> {
  let arrival = arrivals.get(file);
  if (!arrival) {
    arrival = new Promise((done, failed) => {
      const script = document.createElement('script');
      const text = inlined(file);
      if (text === null) {
        script.onload = () => done();
        script.onerror = () => failed(new Error(`${file} is missing: copy the whole folder of the report`));
        script.src = file;
      } else {
        script.textContent = text;
      }
      document.head.append(script);
      if (text !== null) done();
    });
    arrivals.set(file, arrival);
  }
  return arrival;
}

export async function module<T>(name: string): Promise<T> {
  await arrive(`viewer/${name}.js`);
  return modules.get(name) as T;
}

export async function unpack(text: string): Promise<ArrayBuffer> {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

export async function bytes(name: string): Promise<ArrayBuffer> {
  if (!texts.has(name)) await arrive(`data/${name}.js`);
  return unpack(texts.get(name) ?? '');
}

const documents = new Map<string, Promise<unknown>>();
export function json<T>(name: string): Promise<T> {
  let known = documents.get(name);
  if (!known) documents.set(name, (known = bytes(name).then((buffer) => JSON.parse(new TextDecoder().decode(buffer)))));
  return known as Promise<T>;
}
