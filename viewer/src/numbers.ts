// How numbers are shown. Every number of an artefact stands in a <data> element whose value is the artefact's own, so that a
// reader can copy it and a test can look it up; the text is its rounding.
import { h } from './dom';

/** Three digits that count, no exponent, as the plain page writes them. */
export function digits(x: number): string {
  const size = Math.abs(x);
  return x.toFixed(size >= 99.95 ? 0 : size >= 9.995 ? 1 : 2);
}

/** By the name's ending: metres as mm, radians as degrees, seconds as s; a whole number stays whole; small ones keep 3 digits. */
export function text(name: string, x: number | null | undefined): string {
  if (x === null || x === undefined || Number.isNaN(x)) return '–';
  if (name.endsWith('_m')) return `${digits(x * 1000)} mm`;
  if (/_rad(\.|$)/.test(name)) return `${digits((x * 180) / Math.PI)}°`;
  if (name.endsWith('_s')) return `${digits(x)} s`;
  if (name === 'share') return `${(100 * x).toFixed(1)} %`;
  if (Number.isInteger(x)) return String(x);
  return Math.abs(x) < 0.1 ? x.toPrecision(3) : digits(x);
}

export function num(name: string, x: number | null | undefined): HTMLElement {
  const shown = text(name, x);
  return shown === '–' ? h('span', { title: 'no value' }, '–') : h('data', { value: String(x), 'data-name': name, title: `${name} = ${x}` }, shown);
}

/** Wilson's interval of 95 % (Wilson 1927); no trials: the whole of [0, 1]. */
export function wilson(hits: number, trials: number): { share: number; low: number; high: number } {
  if (trials === 0) return { share: 0, low: 0, high: 1 };
  const z = 1.959963984540054, p = hits / trials, n = trials, scale = 1 + (z * z) / n;
  const middle = p + (z * z) / (2 * n), reach = z * Math.sqrt((p * (1 - p)) / n + (z * z) / (4 * n * n));
  return { share: p, low: Math.max(0, (middle - reach) / scale), high: Math.min(1, (middle + reach) / scale) };
}
