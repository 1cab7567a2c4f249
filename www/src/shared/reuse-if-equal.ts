/** Change detection by reference: `reuse` replaces an immutable object only if one of its fields has changed. */

/** `previous` if each of its fields is identical to that of `next`; otherwise `next`. */
export function reuse<T extends object>(previous: T | null | undefined, next: T): T {
  if (!previous) return next;
  const keys = Object.keys(next) as (keyof T)[];
  const isEqual =
    keys.length === Object.keys(previous).length &&
    keys.every((key) => Object.is(previous[key], next[key]));
  return isEqual ? previous : next;
}
