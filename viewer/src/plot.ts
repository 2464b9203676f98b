// A plot with its numbers: SVG to keep, a table to read and to copy.
import * as data from './data';
import { button, copy, h, save, table } from './dom';
import { num } from './numbers';
import type { PlotsModule } from './plots';

export type Row = Record<string, data.Cell>;

export function csv(rows: Row[], columns: string[]): string {
  const cell = (x: data.Cell) => (x === null ? '' : /[",\n]/.test(String(x)) ? `"${String(x).replaceAll('"', '""')}"` : String(x));
  return [columns.join(','), ...rows.map((row) => columns.map((name) => cell(row[name] ?? null)).join(','))].join('\n') + '\n';
}

/** `columns` of `rows` are those that the table shows and that are copied. */
export function plot(title: string, note: string, spec: object, rows: Row[], columns: string[]): HTMLElement {
  const host = h('div', { class: 'plot', role: 'img', 'aria-label': `${title}; its numbers are in the table below` });
  const name = title.toLowerCase().replace(/[^a-z0-9]+/g, '-');
  const box = h('figure', { class: 'plot-box' }, h('figcaption', {}, h('b', {}, title), note ? ` ${note}` : null), host);
  const dark = matchMedia('(prefers-color-scheme: dark)').matches;
  data.module<PlotsModule>('plots').then((plots) => plots.draw(host, { ...spec, data: { values: rows } }, dark)).then((drawn) => {
    host.dataset.ready = 'yes';
    const copied = button('Copy numbers', async () => {
      await copy(csv(rows, columns));
      copied.textContent = 'Copied';
    });
    box.append(h('div', { class: 'row' },
      button('Save SVG', async () => save(`${name}.svg`, await drawn.svg(), 'image/svg+xml')), copied,
      h('details', {}, h('summary', {}, 'Numbers'), table(columns, rows.map((row) => columns.map((key) => {
        const value = row[key];
        return typeof value === 'number' ? num(key, value) : value ?? '–';
      })), `${title}: numbers`))));
  }).catch((error) => host.append(String(error)));
  return box;
}
