// What node runs here also runs on the node of Debian 12, whatever node this one is. (What browsers run asks node for nothing.)
import { readFileSync } from 'node:fs';
import { end, expect } from './checks.mjs';
import { packageFile } from './packages.mjs';

const debian = 18;
for (const tool of ['esbuild', 'gltf-validator', 'playwright-core', 'typescript']) {
  const { version, engines } = JSON.parse(readFileSync(packageFile(`${tool}/package.json`), 'utf8'));
  const least = Number(/(\d+)/.exec(engines?.node ?? '0')[1]);
  expect(`${tool} ${version} runs on node ${debian}`, least <= debian, `it wants ${engines?.node}`);
}
end('tools');
