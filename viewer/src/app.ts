// The report: reads data/overview.js, shows the page that the address names. #overview | object/NAME | grasp/PAIR/N |
// compare/PAIR/N/PAIR/N | sweep | run, and after a '?' how the view was left.
import { install, json, type Overview } from './data';
import { append, h } from './dom';
import { comparePage, graspPage, objectPage, overviewPage, runPage, sweepPage, type Page, type Place } from './pages';

install();

function placeNow(): Place {
  const [path, state] = location.hash.replace(/^#/, '').split('?');
  const place: Place = { path: path.split('/'), state: new URLSearchParams(state ?? ''), remember: () => {} };
  place.remember = () => {
    const query = place.state.toString();
    const address = `#${path}${query ? '?' + query : ''}`;
    try {
      history.replaceState(null, '', address); // no event: the page stays as it is
    } catch {
      // Some browsers refuse this for pages from disk; the link is then the page's alone.
    }
  };
  return place;
}

function pageAt(place: Place, overview: Overview): Page {
  switch (place.path[0]) {
    case 'object': return objectPage(overview, place);
    case 'grasp': return graspPage(overview, place);
    case 'compare': return comparePage(overview, place);
    case 'sweep': return sweepPage(overview);
    case 'run': return runPage(overview);
    default: break;
  }
  if (!isView(overview)) return overviewPage(overview);
  // `geocage view`: what was asked for, at once.
  const pair = overview.pairs[0];
  if (pair.pictures?.length) return graspPage(overview, { ...place, path: ['grasp', '0', '0'] });
  return objectPage(overview, { ...place, path: ['object', encodeURIComponent(pair.object)] });
}

/** A page of `geocage view` tells of no run. */
function isView(overview: Overview): boolean {
  return overview.tables.length === 0 && overview.slots.length === 0 && overview.pairs.length > 0;
}

async function start(): Promise<void> {
  const host = document.getElementById('app')!;
  const main = h('main', { id: 'main', tabindex: -1 });
  let overview: Overview;
  try {
    overview = await json<Overview>('overview');
  } catch (error) {
    append(host, [h('main', {}, h('h1', {}, 'This report can’t be read'), h('p', {}, String(error)), h('p', {}, h('a', { href: 'plain.html' }, 'The plain page'), ' needs no script.'))]);
    return;
  }
  const links: [string, string][] = isView(overview)
    ? overview.pairs.map((pair, i): [string, string] => [pair.pictures?.length ? `grasp/${i}/0` : `object/${encodeURIComponent(pair.object)}`, pair.object]) : [['overview', 'Overview'], ['sweep', overview.success.some((one) => one.by.includes('.')) ? 'Sweep' : 'Distributions'], ['run', 'Run']];
  const anchors = links.map(([path, title]) => h('a', { href: `#${path}` }, title));
  const plain = !isView(overview) && document.querySelector('script[data-file]') === null;
  append(host, [
    h('a', { class: 'skip', href: '#main', onclick: (event: Event) => { event.preventDefault(); main.focus(); } }, 'Skip to content'),
    h('header', {}, h('nav', { 'aria-label': 'pages' }, h('span', { class: 'brand' }, 'geocage'), anchors, plain ? h('a', { href: 'plain.html' }, 'Plain page') : null)),
    main,
    h('footer', {}, overview.run.map(([name, value]) => `${name} ${value}`).join(' · ')),
  ]);
  let page: Page | null = null;
  const show = () => {
    page?.leave?.();
    const place = placeNow();
    page = pageAt(place, overview);
    document.title = page.title === overview.title ? overview.title : `${page.title} · ${overview.title}`;
    main.replaceChildren(...page.nodes);
    const at = ['sweep', 'run'].includes(place.path[0]) ? place.path[0] : 'overview';
    links.forEach(([path], i) => {
      if (path === at) anchors[i].setAttribute('aria-current', 'page');
      else anchors[i].removeAttribute('aria-current');
    });
    scrollTo(0, 0);
    const shown = page;
    main.dataset.ready = 'no';
    (shown.start?.() ?? Promise.resolve()).then(() => {
      if (shown === page) main.dataset.ready = 'yes';
    }, (error) => main.append(h('p', { class: 'warning' }, String(error))));
  };
  window.addEventListener('hashchange', show);
  show();
  performance.mark('geocage-ready');
}

void start();
