/** Workers that run one algorithm together: each sends messages to all others, by a channel for every pair. */

import type { ProcessGroup } from '../engine/recovery-exports.js';
import { Deferred } from '../shared/promises.js';

/** What a worker needs to take part. Ports are transferred. */
export interface GroupMembership {
  /** Number of this worker, from 0 on. */
  readonly rank: number;
  /** To the other workers, in the order of their ranks. */
  readonly ports: readonly MessagePort[];
  /** A message here ends the group. */
  readonly control: MessagePort;
}

/** The page's side of a group. */
export interface CreatedGroup {
  /** In the order of their ranks. */
  readonly members: readonly GroupMembership[];
  /** Exchanges reject from now on: a worker is lost. */
  end(): void;
  /** Releases the page's ports. */
  close(): void;
}

export function createGroup(size: number): CreatedGroup {
  const ports: MessagePort[][] = Array.from({ length: size }, () => []);
  for (const [rank, own] of ports.entries()) {
    for (const other of ports.slice(rank + 1)) {
      const { port1, port2 } = new MessageChannel();
      own.push(port1);
      other.push(port2);
    }
  }
  const controls = ports.map(() => new MessageChannel());
  const members = ports.map((own, rank) => {
    const { port2: control } = controls[rank] as MessageChannel;
    return { rank, ports: own, control };
  });
  return {
    members,
    end(): void {
      for (const { port1 } of controls) port1.postMessage(null);
    },
    close(): void {
      for (const { port1 } of controls) port1.close();
    },
  };
}

export function portsOf({ ports, control }: GroupMembership): MessagePort[] {
  return [...ports, control];
}

/** Messages that have arrived from one worker, and those that are awaited. */
class Inbox {
  readonly #arrived: Uint8Array[][] = [];
  #awaited: Deferred<Uint8Array[]> | null = null;

  put(messages: Uint8Array[]): void {
    if (this.#awaited) this.#awaited.resolve(messages);
    else this.#arrived.push(messages);
    this.#awaited = null;
  }

  take(): Promise<Uint8Array[]> {
    const messages = this.#arrived.shift();
    if (messages) return Promise.resolve(messages);
    this.#awaited = new Deferred();
    return this.#awaited.promise;
  }

  fail(error: Error): void {
    this.#awaited?.reject(error);
    this.#awaited = null;
  }
}

/** While a worker waits for others, it says so to the page, whose watchdog then gives up the worker that is silent. */
const WAITING_REPORT_MS = 1000;

/** A worker's side of a group. */
export class ConnectedGroup implements ProcessGroup {
  readonly rank: number;
  readonly size: number;
  readonly #ports: readonly MessagePort[];
  readonly #control: MessagePort;
  readonly #inboxes: readonly Inbox[];
  #hasEnded = false;

  /** `reportWaiting` is called while it waits for other workers. */
  constructor(
    { rank, ports, control }: GroupMembership,
    private readonly reportWaiting: () => void,
  ) {
    this.rank = rank;
    this.size = ports.length + 1;
    this.#ports = ports;
    this.#control = control;
    this.#inboxes = ports.map((port) => {
      const inbox = new Inbox();
      port.onmessage = ({ data }) => inbox.put(data);
      port.onmessageerror = () => this.#end();
      return inbox;
    });
    control.onmessage = () => this.#end();
  }

  async exchange(own: Uint8Array[]): Promise<Uint8Array[]> {
    if (this.#hasEnded) throw lost();
    for (const port of this.#ports) port.postMessage(own);
    const reports = setInterval(this.reportWaiting, WAITING_REPORT_MS);
    const taken = Promise.all(this.#inboxes.map((inbox) => inbox.take()));
    const others = await taken.finally(() => clearInterval(reports));
    return [...others.slice(0, this.rank), own, ...others.slice(this.rank)].flat();
  }

  close(): void {
    for (const port of [...this.#ports, this.#control]) port.close();
  }

  #end(): void {
    this.#hasEnded = true;
    for (const inbox of this.#inboxes) inbox.fail(lost());
  }
}

function lost(): Error {
  return new Error('a worker of the group is lost');
}
