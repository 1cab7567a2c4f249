/** The canvases of shards over that of the root, which they follow when it is moved, magnified or resized. */

import type { Gamut } from '../engine/wasm-exports.js';
import type { PhotoError } from '../shared/errors.js';
import type { PixelRect } from '../shared/value-types.js';
import type { LevelTable } from './level-table.js';
import type { PictureView } from './shard-selection.js';

/** A change of the visible share of the picture by this part is noticed. */
const VISIBILITY_STEPS = 20;

/** A shard that is drawn. */
export interface PlacedShard {
  readonly id: { readonly level: number };
  /** In pixels of level 0. */
  readonly rect: PixelRect;
  readonly canvas: HTMLCanvasElement | null;
}

/** Bubbles from the layer: a shard has arrived or the view has changed, so that a frame is due; or an error is to be reported. */
export type LayerChangeEvent = CustomEvent<PhotoError | null>;

export class ShardLayer {
  /** Lies over the root's canvas, in the box of the picture, which is moved and magnified. */
  readonly element = document.createElement('div');
  readonly #plane = document.createElement('div');
  /**
   * The level whose pixels are those of the plane: the finest that is shown. Browsers are slow to draw a canvas that is
   * magnified by its size and reduced by a transform.
   */
  #level = 0;
  /** In the page. */
  #size: Pick<DOMRectReadOnly, 'width' | 'height'> = { width: 0, height: 0 };
  readonly #resizes: ResizeObserver;
  readonly #moves: MutationObserver;
  readonly #visibility: IntersectionObserver;
  readonly #end = new AbortController();

  /** `canvas` is that of the root. `hidden` is called when nothing of the picture is visible. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly table: LevelTable,
    hidden: () => void,
  ) {
    const { element } = this;
    const scale = 2 ** (table.levels - 1);
    // The root's last column and row may reach beyond the picture.
    canvas.style.width = `${(100 * canvas.width * scale) / table.width}%`;
    canvas.style.height = `${(100 * canvas.height * scale) / table.height}%`;
    Object.assign(element.style, { position: 'absolute', inset: '0', pointerEvents: 'none' });
    Object.assign(this.#plane.style, { position: 'absolute', transformOrigin: '0 0' });
    element.append(this.#plane);
    // Its pixels are coarser than those of the picture.
    canvas.style.imageRendering = 'auto';
    this.#resizes = new ResizeObserver(([entry]) => {
      if (entry) this.#follow(entry.contentRect);
    });
    this.#resizes.observe(element);
    this.#moves = new MutationObserver(() => this.requestFrame());
    // Also where the page scrolls.
    const threshold = Array.from({ length: VISIBILITY_STEPS + 1 }, (_, i) => i / VISIBILITY_STEPS);
    this.#visibility = new IntersectionObserver(
      (entries) => (entries.at(-1)?.isIntersecting ? this.requestFrame() : hidden()),
      { threshold },
    );
    // Magnifying the page changes the size of its pixels.
    addEventListener('resize', () => this.requestFrame(), { signal: this.#end.signal });
  }

  /** The visible part of the picture; `null` if there is none. */
  view(): PictureView | null {
    const { element, table } = this;
    const picture = element.getBoundingClientRect();
    const viewport = element.parentElement?.parentElement?.getBoundingClientRect();
    const root = element.getRootNode();
    if (!viewport || !(root instanceof ShadowRoot)) return null;
    if (picture.width === 0 || picture.height === 0) return null;
    // The element cuts off what object-fit has beyond it.
    const host = root.host.getBoundingClientRect();
    const box = {
      left: Math.max(viewport.left, host.left),
      top: Math.max(viewport.top, host.top),
      right: Math.min(viewport.right, host.right),
      bottom: Math.min(viewport.bottom, host.bottom),
    };
    const [across, down] = [table.width / picture.width, table.height / picture.height];
    const pixels = (left: number, top: number, right: number, bottom: number): PixelRect => ({
      left: (left - picture.left) * across,
      top: (top - picture.top) * down,
      right: (right - picture.left) * across,
      bottom: (bottom - picture.top) * down,
    });
    const [right, bottom] = [Math.min(box.right, innerWidth), Math.min(box.bottom, innerHeight)];
    const rect = pixels(Math.max(box.left, 0), Math.max(box.top, 0), right, bottom);
    if (rect.left >= rect.right || rect.top >= rect.bottom) return null;
    const scale = devicePixelRatio / Math.min(across, down);
    return { rect, scale, box: pixels(box.left, box.top, box.right, box.bottom) };
  }

  /** Shows these, and no others. */
  show(shards: ReadonlySet<PlacedShard>): void {
    const shown = new Set<Node>();
    const level = Math.min(...[...shards].map(({ id }) => id.level));
    const isMoved = shards.size > 0 && level !== this.#level;
    if (isMoved) {
      this.#level = level;
      this.#fit();
    }
    const unit = 2 ** this.#level;
    for (const { id, rect, canvas } of shards) {
      if (!canvas) continue;
      shown.add(canvas);
      if (canvas.parentNode === this.#plane && !isMoved) continue;
      const side = 2 ** id.level / unit;
      Object.assign(canvas.style, {
        position: 'absolute',
        left: `${rect.left / unit}px`,
        top: `${rect.top / unit}px`,
        width: `${canvas.width * side}px`,
        height: `${canvas.height * side}px`,
        // Finer ones lie over coarser ones.
        zIndex: String(-id.level),
      });
      if (canvas.parentNode !== this.#plane) this.#plane.append(canvas);
    }
    for (const canvas of [...this.#plane.childNodes]) if (!shown.has(canvas)) canvas.remove();
  }

  requestFrame(): void {
    this.#dispatch(null);
  }

  report(error: PhotoError): void {
    this.#dispatch(error);
  }

  /** The whole picture in the resolution of the finest of `shards`, with sides of at most `maxSide`. */
  snapshot(shards: Iterable<PlacedShard>, gamut: Gamut, maxSide: number): HTMLCanvasElement {
    const sorted = [...shards].sort((a, b) => b.id.level - a.id.level);
    const finest = sorted.at(-1)?.id.level;
    const { canvas, table } = this;
    const { width, height } = table;
    const root = 2 ** (table.levels - 1);
    const wanted = 1 / (finest === undefined ? root : 2 ** finest);
    const factor = Math.min(wanted, maxSide / Math.max(width, height));
    const copy = document.createElement('canvas');
    copy.width = Math.max(1, Math.round(width * factor));
    copy.height = Math.max(1, Math.round(height * factor));
    const context = copy.getContext('2d', { colorSpace: gamut });
    const scale = root * factor;
    context?.drawImage(canvas, 0, 0, canvas.width * scale, canvas.height * scale);
    for (const { id, rect, canvas: part } of sorted) {
      if (!part) continue;
      const side = 2 ** id.level * factor;
      const [left, top] = [rect.left * factor, rect.top * factor];
      context?.drawImage(part, left, top, part.width * side, part.height * side);
    }
    return copy;
  }

  free(): void {
    this.#resizes.disconnect();
    this.#moves.disconnect();
    this.#visibility.disconnect();
    this.#end.abort();
    this.element.remove();
  }

  /** Fits into the box of the picture, and follows it. */
  #follow(size: Pick<DOMRectReadOnly, 'width' | 'height'>): void {
    const { parentElement: content } = this.element;
    this.#size = size;
    this.#fit();
    if (content) this.#moves.observe(content, { attributeFilter: ['style'] });
    if (content?.parentElement) this.#visibility.observe(content.parentElement);
    this.requestFrame();
  }

  #fit(): void {
    const { width, height } = this.table;
    const unit = 2 ** this.#level;
    const [across, down] = [this.#size.width / width, this.#size.height / height];
    this.#plane.style.transform = `scale(${across * unit}, ${down * unit})`;
  }

  #dispatch(detail: PhotoError | null): void {
    this.element.dispatchEvent(new CustomEvent('change', { bubbles: true, detail }));
  }
}
