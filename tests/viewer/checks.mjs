// How a test says that something is wrong, or that it can't look.
export const skipped = 77;
export function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(skipped);
}

let failures = 0;
export function expect(what, ok, told = '') {
  if (ok) return;
  ++failures;
  console.log(`FAILED: ${what}${told === '' ? '' : ': ' + told}`);
}
export function end(what) {
  console.log(failures ? `${failures} of the checks failed` : `${what}: all checks hold`);
  process.exit(failures ? 1 : 0);
}
