/** What elements are made of, without markup, which a content security policy may refuse. */

/** An element with a class, and a name by which pages may style it. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  { name = '', part = '', attributes = {} }: MakeOptions = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (part) element.setAttribute('part', part);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

interface MakeOptions {
  readonly name?: string;
  readonly part?: string;
  readonly attributes?: Readonly<Record<string, string>>;
}

/** A place that pages may fill with something of their own. */
export function slot(name: string, ...otherwise: (Node | string)[]): HTMLSlotElement {
  return make('slot', { attributes: { name } }, ...otherwise);
}

/** Sets an attribute where it is another; `null` takes it away. */
export function put(element: Element, name: string, value: string | null): void {
  if (element.getAttribute(name) === value) return;
  if (value === null) element.removeAttribute(name);
  else element.setAttribute(name, value);
}

/** Sets a text where it is another: what is read out is not read out twice. */
export function write(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
