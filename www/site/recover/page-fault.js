/** A fault that the page finds itself. Its text is in the page's language, under `fault.` and the code. */
export class PageFault extends Error {
  /** @param {string} code @param {Record<string, string | number>} [values] of the text */
  constructor(code, values = {}) {
    super(code);
    this.name = 'PageFault';
    this.code = code;
    this.values = values;
  }
}
