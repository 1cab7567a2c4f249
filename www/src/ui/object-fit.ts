/**
 * Places the picture in the element's content box by `object-fit` and `object-position`, as browsers do for `<img>`.
 * CSS computes the place in container units, so that it also follows the box where no script runs, as in print.
 */

/** The place along one axis: a share of the free space, and an offset in pixels. */
interface AxisPosition {
  readonly share: number;
  readonly offset: number;
}

/** `style` is the element's computed style. The style sheet defines the sizes by name of the fit. */
export function placePicture(
  picture: HTMLElement,
  { objectFit, objectPosition }: Pick<CSSStyleDeclaration, 'objectFit' | 'objectPosition'>,
): void {
  const { style } = picture;
  const isStretched = objectFit === 'fill';
  const width = `var(--_${objectFit})`;
  style.setProperty('--_width', isStretched ? '100cqw' : width);
  style.setProperty('--_height', isStretched ? '100cqh' : `calc(${width} / var(--_ratio))`);
  const [x, y] = parsePosition(objectPosition);
  style.setProperty('--_left', `calc((100cqw - var(--_width)) * ${x.share} + ${x.offset}px)`);
  style.setProperty('--_top', `calc((100cqh - var(--_height)) * ${y.share} + ${y.offset}px)`);
}

/** Reads a computed `object-position`, such as `50% 50%` or `calc(100% - 10px) 0px`. */
export function parsePosition(text: string): readonly [x: AxisPosition, y: AxisPosition] {
  const [x, y] = text.match(/calc\([^)]*\)|\S+/g) ?? [];
  return [parseAxis(x), parseAxis(y)];
}

function parseAxis(text = '50%'): AxisPosition {
  const sum = (unit: string) => {
    const [, sign, size] = new RegExp(`([-+]?) *([\\d.]+)${unit}`).exec(text) ?? [];
    return Number(size ?? 0) * (sign === '-' ? -1 : 1);
  };
  return { share: sum('%') / 100, offset: sum('px') };
}
