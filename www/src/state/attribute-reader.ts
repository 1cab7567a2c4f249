/**
 * Reads and parses attributes. An invalid attribute keeps its last valid value, or its default. An attribute is parsed
 * again only after a change, so equal values are the same object.
 */

import { type PhotoError, toPhotoError } from '../shared/errors.js';
import { type PARSERS, type ParsedValue, parseAddress, parserOf } from './attribute-parsers.js';

interface ParsedAttribute {
  readonly text: string | null;
  /** The base address against which an address was resolved. */
  readonly base: string;
  readonly value: unknown;
  readonly error: PhotoError | null;
}

export class AttributeReader {
  readonly #attributes = new Map<string, ParsedAttribute>();
  #newErrors: PhotoError[] = [];

  constructor(private readonly source: Pick<Element, 'baseURI' | 'getAttribute'>) {}

  /** The parsed value of one of the attributes in `PARSERS`. */
  read<K extends keyof typeof PARSERS>(name: K): ParsedValue<K> {
    return this.parse(name, parserOf(name));
  }

  /** Parses any attribute. `parse(null)` must give the default. */
  parse<T>(name: string, parse: (text: string | null) => T, base = ''): T {
    const text = this.source.getAttribute(name);
    const last = this.#attributes.get(name);
    if (last?.text === text && last.base === base) return last.value as T;
    let value: unknown;
    let error: PhotoError | null = null;
    try {
      value = parse(text);
    } catch (thrown) {
      error = toPhotoError(thrown);
      value = last ? last.value : parse(null);
      this.#newErrors.push(error);
    }
    this.#attributes.set(name, { text, base, value, error });
    return value as T;
  }

  /** The absolute URL of an attribute; `null` if it is empty. */
  readAddress(name: string): string | null {
    const { baseURI } = this.source;
    return this.parse(name, (text) => parseAddress(text, name, baseURI), baseURI);
  }

  has(name: string): boolean {
    return this.source.getAttribute(name) !== null;
  }

  /** Why an attribute is invalid; `null` if it is not, or was not read. */
  errorOf(name: string): PhotoError | null {
    return this.#attributes.get(name)?.error ?? null;
  }

  /** The errors since the last call. */
  takeErrors(): readonly PhotoError[] {
    return this.#newErrors.splice(0);
  }

  clear(): void {
    this.#attributes.clear();
    this.#newErrors = [];
  }
}
