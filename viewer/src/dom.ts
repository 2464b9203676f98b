// Elements without a framework. Text is always text: nothing here parses HTML.

type Child = Node | string | number | null | undefined | false | Child[];
type Attributes = Record<string, string | number | boolean | null | undefined | EventListener>;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === 'function') element.addEventListener(name.replace(/^on/, ''), value);
    else element.setAttribute(name, value === true ? '' : String(value));
  }
  append(element, children);
  return element;
}

export function append(to: Element, children: Child[]): void {
  for (const child of children) {
    if (Array.isArray(child)) append(to, child);
    else if (child !== null && child !== undefined && child !== false) to.append(child instanceof Node ? child : String(child));
  }
}

/** A table in a box that scrolls sideways; cells are text or nodes. */
export function table(head: Child[], rows: Child[][], caption = '', attributes: Attributes = {}): HTMLElement {
  return h('div', { class: 'wide', tabindex: 0, role: 'region', 'aria-label': caption || 'table' },
    h('table', attributes,
      h('thead', {}, h('tr', {}, head.map((cell) => h('th', { scope: 'col' }, cell)))),
      h('tbody', {}, rows.map((row) => h('tr', {}, row.map((cell) => h('td', {}, cell)))))));
}

export function select(label: string, options: [string, string][], value: string, changed: (value: string) => void): HTMLLabelElement {
  const box = h('select', { onchange: () => changed(box.value) },
    options.map(([key, title]) => h('option', { value: key, selected: key === value }, title)));
  return h('label', {}, label, ' ', box);
}

export function check(label: string, value: boolean, changed: (value: boolean) => void, hint = ''): HTMLLabelElement {
  const box = h('input', { type: 'checkbox', checked: value, onchange: () => changed(box.checked) });
  return h('label', { class: 'check', title: hint || null }, box, ' ', label);
}

export function slider(label: string, low: number, high: number, step: number, value: number, changed: (value: number) => void) {
  const box = h('input', { type: 'range', min: low, max: high, step, value, oninput: () => changed(Number(box.value)) });
  return { label: h('label', { class: 'slide' }, h('span', {}, label), box), box };
}

export function button(label: string, pressed: () => void, attributes: Attributes = {}): HTMLButtonElement {
  return h('button', { type: 'button', onclick: pressed, ...attributes }, label);
}

export function save(name: string, content: BlobPart, type: string): void {
  const address = URL.createObjectURL(new Blob([content], { type }));
  h('a', { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

/** Copies; where the browser refuses (some do for pages from disk), by an old way that asks nobody. */
export async function copy(text: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const box = h('textarea', { 'aria-hidden': 'true' });
    box.value = text;
    document.body.append(box);
    box.select();
    document.execCommand('copy');
    box.remove();
  }
}
