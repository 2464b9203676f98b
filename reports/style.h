#pragma once

namespace geocage::reports {

/// The page's look, in the light and in the dark.
inline constexpr char style_sheet[] = R"css(
:root { color-scheme: light dark; --ink: #1d2430; --soft: #5c6675; --line: #dfe3ea; --page: #f5f6f9; --card: #fff;
  --accent: #2b6cb0; --good: #1f8a54; --bad: #c2412d; --warn: #b7791f; --earlier: #b9c6d8; --stage: #eef1f6; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ef; --soft: #9aa5b5; --line: #2d3441; --page: #12151b; --card: #1a1f28;
    --accent: #6aa9e9; --good: #4fbf87; --bad: #ec7f6c; --warn: #dfae55; --earlier: #44546a; --stage: #2a313d; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.55 system-ui, sans-serif; }
main { max-width: 1240px; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 2rem; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.35rem; margin: 0 0 .6rem; }
h3 { font-size: 1rem; margin: 1.6rem 0 .5rem; }
p { margin: .4rem 0 .8rem; max-width: 75ch; }
.soft, figcaption, footer { color: var(--soft); }
section { background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 1.4rem 1.6rem;
  margin: 1.4rem 0; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(120px, 1fr)); gap: .8rem; margin: 1.2rem 0 .6rem; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: .7rem 1rem; }
.tile b { display: block; font-size: 1.7rem; line-height: 1.2; font-variant-numeric: tabular-nums; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 1rem; margin: 1rem 0; }
figure { margin: 0; border: 1px solid var(--line); border-radius: 10px; overflow: hidden; display: flex;
  flex-direction: column; }
figure img { width: 100%; height: auto; display: block; aspect-ratio: 4 / 3;
  background: radial-gradient(circle at 50% 40%, var(--card), var(--stage)); }
figcaption { padding: .7rem .9rem .8rem; font-size: .88rem; border-top: 1px solid var(--line); flex: 1; }
figcaption b { color: var(--ink); display: block; font-size: .95rem; }
.key { display: flex; align-items: center; gap: .5rem; margin-top: .5rem; flex-wrap: wrap; }
svg text { fill: var(--ink); font: 11px system-ui, sans-serif; }
.legend { width: 200px; height: 26px; } .legend text { font-size: 10px; }
.swatch { width: 14px; height: 14px; border-radius: 3px; }
.interval { width: 212px; height: 12px; vertical-align: middle; margin: 0 .6rem; }
.track { fill: var(--stage); } .range { fill: var(--accent); opacity: .45; } .mark { fill: var(--accent); }
.chart { width: 100%; max-width: 640px; } .now { fill: var(--accent); } .earlier { fill: var(--earlier); }
.wide { overflow-x: auto; margin: .5rem 0; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .35rem .55rem .35rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; } tr:last-child td { border-bottom: 0; }
td.text, .text td:last-child { white-space: normal; min-width: 14rem; }
.badge { display: inline-block; padding: .05rem .6rem; border-radius: 99px; font-size: .82rem; font-weight: 600;
  color: var(--card); background: var(--soft); vertical-align: middle; }
.done, .held { background: var(--good); } .failed, .lost, .error { background: var(--bad); }
.rejected, .unsettled { background: var(--warn); }
.pushes { display: inline-flex; gap: 4px; }
.push { display: inline-block; width: 2.1em; text-align: center; border-radius: 5px; font-size: .78rem; color: var(--card); }
.push.held { background: var(--good); } .push.lost { background: var(--bad); }
.warning { border-left: 4px solid var(--bad); padding: .5rem 1rem; background: var(--stage); border-radius: 0 8px 8px 0; }
details { margin: .5rem 0; } summary { cursor: pointer; color: var(--accent); }
pre, code { font: .85rem/1.5 ui-monospace, monospace; } pre { overflow-x: auto; background: var(--stage);
  padding: .8rem 1rem; border-radius: 8px; }
a { color: var(--accent); } footer { font-size: .85rem; margin-top: 2rem; }
)css";

}  // namespace geocage::reports
