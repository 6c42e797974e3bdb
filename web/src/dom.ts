/** Elements without a framework. */

type Child = Node | string | null | undefined | false | Child[];
type Props = Record<string, unknown>;

function put(parent: Element, child: Child): void {
  if (Array.isArray(child)) child.forEach((c) => put(parent, c));
  else if (child !== null && child !== undefined && child !== false) parent.append(child);
}

function assign(element: Element, props: Props): void {
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on') && typeof value === 'function') {
      element.addEventListener(name.slice(2), value as EventListener);
    } else {
      element.setAttribute(name, value === true ? '' : String(value));
    }
  }
}

/** An HTML element: `h('button.icon', { title: '...' , onclick: f }, 'text')`. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K | `${K}.${string}`,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const [name, ...classes] = tag.split('.');
  const element = document.createElement(name as K);
  if (classes.length > 0) element.className = classes.join(' ');
  assign(element, props);
  put(element, children);
  return element;
}

/** Text of the core, with what stands between backticks as code. */
export function prose(text: string): (string | HTMLElement)[] {
  return text.split('`').map((part, i) => (i % 2 === 1 ? h('code', {}, part) : part));
}

const ICONS = {
  play: 'M4 2.5v11l9-5.5z',
  pause: 'M4 2.5h3v11H4zm5 0h3v11H9z',
  reset: 'M8 3V.6L4.4 4 8 7.4V5a3.5 3.5 0 1 1-3.4 4.4H2.8A5.3 5.3 0 1 0 8 3z',
  undo: 'M6.2 4.4V1.2L1.4 5.6l4.8 4.4V6.8c3 0 5.4.9 7.4 4.2-.4-4.2-3-6.6-7.4-6.6z',
  redo: 'M9.8 4.4V1.2l4.8 4.4-4.8 4.4V6.8c-3 0-5.4.9-7.4 4.2.4-4.2 3-6.6 7.4-6.6z',
  close: 'M3.5 2.4 8 6.9l4.5-4.5 1.1 1.1L9.1 8l4.5 4.5-1.1 1.1L8 9.1l-4.5 4.5-1.1-1.1L6.9 8 2.4 3.5z',
  table: 'M1.5 2.5h13v11h-13zm1.4 3.2v1.9h3.2V5.7zm4.6 0v1.9h5.6V5.7zM2.9 9v3.1h3.2V9zm4.6 0v3.1h5.6V9z',
  fit: 'M1.5 1.5H6V3H3v3H1.5zM10 1.5h4.5V6H13V3h-3zM1.5 10H3v3h3v1.5H1.5zm11.5 0h1.5v4.5H10V13h3z',
  more: 'M1 2.5h14V4H1zm0 4.8h14v1.4H1zM1 12h14v1.5H1z',
} as const;

/** An icon of 16 by 16, not read aloud. */
export function icon(name: keyof typeof ICONS): SVGSVGElement {
  const space = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(space, 'svg');
  assign(svg, { viewBox: '0 0 16 16', class: 'icon', 'aria-hidden': 'true', 'fill-rule': 'evenodd' });
  const path = document.createElementNS(space, 'path');
  path.setAttribute('d', ICONS[name]);
  svg.append(path);
  return svg;
}

/** A button that shows an icon and says `label`. */
export function iconButton(name: keyof typeof ICONS, label: string, onclick: (event: MouseEvent) => void): HTMLButtonElement {
  return h('button.icon-button', { type: 'button', title: label, 'aria-label': label, onclick }, icon(name));
}

/** Give the reader a file. */
export function save(name: string, content: BlobPart, type: string): void {
  const url = URL.createObjectURL(new Blob([content], { type }));
  const link = h('a', { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** The size of an element in CSS pixels, now and after every change. */
export function onResize(element: Element, listener: (width: number, height: number) => void): void {
  new ResizeObserver((entries) => {
    const box = entries[entries.length - 1]?.contentRect;
    if (box) listener(Math.round(box.width), Math.round(box.height));
  }).observe(element);
}
