// A headless Chromium with WebGL in software.
import { existsSync } from 'node:fs';
import { skip } from './checks.mjs';
import { packageOf } from './packages.mjs';

export function chromiumPath() {
  const known = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
  return known.find((path) => path && existsSync(path)) ?? skip('there is no Chromium here');
}

export async function browser(extra = []) {
  const { chromium } = packageOf('playwright-core');
  return chromium.launch({
    executablePath: chromiumPath(), headless: true,
    args: ['--no-sandbox', '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run',
      ...(extra.length ? extra : ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'])],
  });
}
