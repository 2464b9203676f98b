// Plots by Vega-Lite, drawn as SVG. Registers itself as the module "plots".
import { parse, View } from 'vega';
import { compile, type TopLevelSpec } from 'vega-lite';

export interface PlotsModule { draw(host: HTMLElement, spec: object, dark: boolean): Promise<{ svg(): Promise<string> }> }

async function draw(host: HTMLElement, spec: object, dark: boolean) {
  const ink = dark ? '#e6e9ef' : '#1d2430', line = dark ? '#3a4352' : '#d5dae3';
  const config = {
    background: 'transparent', font: 'system-ui, sans-serif', view: { stroke: 'transparent' },
    axis: { labelColor: ink, titleColor: ink, gridColor: line, domainColor: line, tickColor: line, labelFontSize: 12, titleFontSize: 12, titleFontWeight: 500, labelLimit: 460 },
    legend: { symbolOpacity: 1, labelColor: ink, titleColor: ink, labelFontSize: 12, titleFontSize: 12, labelLimit: 460 }, title: { color: ink },
    header: { labelColor: ink, titleColor: ink },
  };
  const compiled = compile({ $schema: 'https://vega.github.io/schema/vega-lite/v6.json', ...spec, config } as unknown as TopLevelSpec);
  const view = new View(parse(compiled.spec), { renderer: 'svg', container: host, hover: true });
  await view.runAsync();
  host.querySelector('svg')?.setAttribute('aria-hidden', 'true'); // the table below says the same
  return { svg: () => view.toSVG() };
}

declare const geocage: { module(name: string, api: PlotsModule): void };
geocage.module('plots', { draw });
