// Numbers as colours: maps of even perceived steps that stay readable for colour-blind people, since lightness alone orders them.
import { interpolateCividis, interpolateViridis } from 'd3-scale-chromatic';

export type Rgb = [number, number, number]; // sRGB, 0..1
export type MapName = 'dusk' | 'viridis' | 'cividis' | 'balance';
export const mapTitles: Record<MapName, string> = {
  dusk: 'violet–yellow', viridis: 'viridis', cividis: 'cividis', balance: 'blue–pale–red',
};

/** OKLCh (Ottosson 2020) to sRGB, chroma lowered until the colour exists: the formula of reports/colours.cpp. */
export function oklch(lightness: number, chroma: number, hueDeg: number): Rgb {
  const hue = (hueDeg * Math.PI) / 180;
  const linear = (c: number): Rgb => {
    const a = c * Math.cos(hue), b = c * Math.sin(hue);
    const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
    const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
    const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
    return [4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
      -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s, -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s];
  };
  const exists = (rgb: Rgb) => rgb.every((x) => x >= 0 && x <= 1);
  const encode = (rgb: Rgb): Rgb =>
    rgb.map((x) => Math.min(1, Math.max(0, x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055))) as Rgb;
  if (exists(linear(chroma))) return encode(linear(chroma));
  let inside = 0, outside = chroma;
  for (let i = 0; i < 20; ++i) {
    const middle = (inside + outside) / 2;
    if (exists(linear(middle))) inside = middle;
    else outside = middle;
  }
  return encode(linear(inside).map((x) => Math.min(1, Math.max(0, x))) as Rgb);
}

function parsed(colour: string): Rgb {
  const hex = /^#(..)(..)(..)$/.exec(colour);
  const parts = hex ? hex.slice(1).map((x) => parseInt(x, 16)) : (colour.match(/\d+/g) ?? []).map(Number);
  return [parts[0] / 255, parts[1] / 255, parts[2] / 255];
}

export function colourAt(map: MapName, t: number): Rgb {
  const x = Math.min(1, Math.max(0, t));
  if (map === 'viridis') return parsed(interpolateViridis(x));
  if (map === 'cividis') return parsed(interpolateCividis(x));
  if (map === 'dusk') return oklch(0.27 + 0.65 * x, 0.09 + 0.1 * x, 300 - 195 * x);
  const side = 2 * x - 1;
  return oklch(0.94 - 0.46 * Math.abs(side), 0.19 * Math.abs(side), side < 0 ? 255 : 28);
}

export const css = (rgb: Rgb): string => '#' + rgb.map((x) => Math.round(255 * x).toString(16).padStart(2, '0')).join('');
export const noValue: Rgb = [0.63, 0.63, 0.63];

const tables = new Map<MapName, Rgb[]>();
/** The map in 256 steps, made once. */
export function lookUp(map: MapName): Rgb[] {
  let known = tables.get(map);
  if (!known) tables.set(map, (known = Array.from({ length: 256 }, (_, i) => colourAt(map, i / 255))));
  return known;
}

/** Where a value lies in a range, 0..1; in the middle of a range without width. */
export const shareOf = (x: number, low: number, high: number): number =>
  high > low ? Math.min(1, Math.max(0, (x - low) / (high - low))) : 0.5;

/** The range without the outer half per cents; symmetric about 0 for a map with two sides. */
export function rangeOf(values: ArrayLike<number>, map: MapName): [number, number] {
  const finite = Array.from(values).filter(Number.isFinite);
  if (finite.length === 0) return [0, 1];
  if (map === 'balance') {
    const sizes = finite.map(Math.abs).sort((a, b) => a - b);
    const reach = sizes[Math.round(0.99 * (sizes.length - 1))] || 1;
    return [-reach, reach];
  }
  finite.sort((a, b) => a - b);
  const low = finite[Math.round(0.005 * (finite.length - 1))], high = finite[Math.round(0.995 * (finite.length - 1))];
  return [low, high];
}

/** Okabe and Ito's palette (2008): outcomes differ for every kind of colour vision, and are always written out too. */
export const outcomeColours: Record<string, string> = {
  held: '#0072B2', lost: '#D55E00', rejected: '#7a7a7a', unsettled: '#9a6700', error: '#a8457f', 'not tested': '#7a7a7a',
};
