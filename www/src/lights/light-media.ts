/** The picture or film of the `light-src` attribute. */

/** How files of other origins are asked for. */
export type CrossOrigin = 'anonymous' | 'use-credentials' | null;

const FILM = /\.(mp4|m4v|webm|ogv|mov)$/i;

/** Whether an address is that of a film, by the end of its path. */
export function isFilm(address: string): boolean {
  return FILM.test(new URL(address).pathname);
}

/** See the module. Made anew for another address. */
export class LightMedia {
  readonly address: string;
  readonly crossOrigin: CrossOrigin;
  readonly source: HTMLImageElement | HTMLVideoElement;
  readonly #film: HTMLVideoElement | null = null;
  #plays = false;

  constructor(address: string, crossOrigin: CrossOrigin) {
    this.address = address;
    this.crossOrigin = crossOrigin;
    if (isFilm(address)) {
      const film = document.createElement('video');
      Object.assign(film, { muted: true, loop: true, playsInline: true, preload: 'auto' });
      this.#film = film;
    }
    this.source = this.#film ?? new Image();
    this.source.crossOrigin = crossOrigin;
    this.source.src = address;
  }

  /** Whether it can play. */
  get isFilm(): boolean {
    return this.#film !== null;
  }

  /** Plays a film, or holds it where it is. */
  set plays(plays: boolean) {
    if (!this.#film || plays === this.#plays) return;
    this.#plays = plays;
    // A film that cannot be played tells by its own events; one that may not stays at its first frame.
    if (plays) void this.#film.play().catch(() => {});
    else this.#film.pause();
  }

  /** Lets it go. */
  stop(): void {
    this.source.removeAttribute('src');
    this.#film?.load();
  }
}
