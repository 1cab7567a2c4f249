/** Style sheets, one for all elements of a page. */

const sheets = new Map<string, CSSStyleSheet>();

/** Styles what is in a shadow root. */
export function adopt(root: ShadowRoot, style: string): void {
  let sheet = sheets.get(style);
  if (!sheet) {
    // A constructed sheet needs no 'unsafe-inline' in the page's content security policy.
    sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    sheets.set(style, sheet);
  }
  root.adoptedStyleSheets = [...root.adoptedStyleSheets, sheet];
}
