/** Keeps a visitor's first input until the script for gestures and keys has arrived. */

const TYPES = ['pointerdown', 'pointermove', 'pointerup', 'pointercancel', 'keydown', 'keyup'];

type EventClass = new (type: string, fields: Event) => Event;

export class EarlyInput {
  readonly #listening = new AbortController();
  /** The target is kept as well: a finished event names the element that hosts the shadow root. */
  #events: { readonly event: Event; readonly target: EventTarget | null }[] = [];

  /** Keeps events while `isAccepted`. */
  constructor(
    private readonly root: ShadowRoot,
    isAccepted: () => boolean,
  ) {
    const { signal } = this.#listening;
    const keep = (event: Event) => {
      if (isAccepted()) this.#events.push({ event, target: event.target });
    };
    for (const type of TYPES) root.addEventListener(type, keep, { signal, passive: true });
  }

  /** Dispatches the events again, but not to the page, which has received them. */
  replay(): void {
    this.#listening.abort();
    for (const { event, target } of this.#events) {
      const stop = (event: Event) => event.stopPropagation();
      this.root.addEventListener(event.type, stop, { once: true });
      target?.dispatchEvent(new (event.constructor as EventClass)(event.type, event));
    }
    this.#events = [];
  }
}
