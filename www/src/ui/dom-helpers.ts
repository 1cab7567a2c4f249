/** Creates and updates elements without markup, which a content security policy may forbid. */

export function createElement<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string>> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

export function createSlot(name: string, ...fallback: (Node | string)[]): HTMLSlotElement {
  return createElement('slot', { name }, ...fallback);
}

/** Sets an attribute if it differs; `null` removes it. */
export function updateAttribute(element: Element, name: string, value: string | null): void {
  if (element.getAttribute(name) === value) return;
  if (value === null) element.removeAttribute(name);
  else element.setAttribute(name, value);
}

/** Sets a text if it differs, so that screen readers do not read it again. */
export function updateText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
