import assert from 'node:assert/strict';
import test from 'node:test';
import { prepareTogether } from './prepare-together.js';
import { ConnectedGroup, createGroup, type GroupMembership } from './process-group.js';
import { FakeWorker, fakeClient, settle } from './recovery-fakes.js';

const SETTINGS = { method: 'learned', basis: undefined, window: 15 } as const;

function prepare(coordinator: FakeWorker, workers: readonly FakeWorker[]) {
  const clients = workers.map((worker) => fakeClient(worker));
  const done = prepareTogether(fakeClient(coordinator), clients, SETTINGS, () => {});
  done.catch(() => {});
  return { done, clients };
}

let waiting = (): void => {};

/** Connects a group; its workers call `waiting` while they wait. */
function connect(size: number) {
  const group = createGroup(size);
  const workers = group.members.map((member) => new ConnectedGroup(member, () => waiting()));
  return { group, workers };
}

test('each worker of a group gets the messages of all, in order of ranks', async () => {
  const { workers } = connect(3);
  for (const round of [0, 1]) {
    const own = (rank: number) => [Uint8Array.of(rank, round), Uint8Array.of(rank, round, 1)];
    const exchanged = workers.map((worker) => worker.exchange(own(worker.rank)));
    const all = [0, 1, 2].flatMap(own);
    assert.deepEqual(await Promise.all(exchanged), [all, all, all]);
  }
  for (const worker of workers) worker.close();
});

test('messages of a faster worker wait', async () => {
  const { workers } = connect(2);
  const [slow, fast] = workers as [ConnectedGroup, ConnectedGroup];
  const first = fast.exchange([Uint8Array.of(1)]);
  await settle();
  const both = [Uint8Array.of(2), Uint8Array.of(1)];
  assert.deepEqual(await slow.exchange([Uint8Array.of(2)]), both);
  assert.deepEqual(await first, both);
  for (const worker of workers) worker.close();
});

test('the end of a group rejects exchanges in progress, and later ones', async () => {
  const { group, workers } = connect(2);
  const [worker] = workers as [ConnectedGroup];
  const pending = worker.exchange([Uint8Array.of(1)]);
  group.end();
  await assert.rejects(pending, /lost/);
  await assert.rejects(worker.exchange([Uint8Array.of(1)]), /lost/);
  for (const each of workers) each.close();
});

test('workers prepare with the coordinator, which has no part in a group alone', async () => {
  const members: unknown[] = [];
  const coordinator = new FakeWorker({
    prepare: (...args: unknown[]) => {
      members.push(args[1]);
      return {};
    },
  });
  const { done, clients } = prepare(coordinator, [new FakeWorker(), new FakeWorker()]);
  const { isPrepared } = await done;
  assert.deepEqual(await Promise.all(clients.map((client) => isPrepared.get(client))), [
    true,
    true,
  ]);
  const alone = await prepare(coordinator, []).done;
  assert.equal(alone.isPrepared.size, 0);
  assert.deepEqual(
    members.map((member) => (member as { rank: number } | null)?.rank),
    [0, undefined],
  );
});

test('if a worker is lost, the coordinator prepares alone, and the others live on', async () => {
  const dying = new FakeWorker();
  dying.silentMethod = 'prepareWith';
  const other = new FakeWorker({
    prepareWith: () => {
      throw { code: 'worker-unavailable', message: 'lost' };
    },
  });
  const members: unknown[] = [];
  const coordinator = new FakeWorker({
    prepare: (_: unknown, member: unknown) => {
      members.push(member);
      if (member) throw { code: 'worker-unavailable', message: 'lost' };
      return { tiles: 1 };
    },
  });
  const { done, clients } = prepare(coordinator, [dying, other]);
  await settle();
  dying.crash();
  const { summary, isPrepared } = await done;
  assert.deepEqual([members.length, members[1], summary.tiles], [2, null, 1]);
  assert.deepEqual(await Promise.all(clients.map((client) => isPrepared.get(client))), [
    false,
    false,
  ]);
  assert.deepEqual([dying.hasEnded, other.hasEnded], [true, false]);
});

test('a worker that finds a fault of the input does not end the group', async () => {
  const fault = { code: 'recover-mismatch', message: 'shots[3]' };
  let control: MessagePort | undefined;
  const coordinator = new FakeWorker({
    prepare: (_: unknown, member: GroupMembership) => {
      control = member.control;
      return {};
    },
  });
  const worker = new FakeWorker({
    prepareWith: () => {
      throw fault;
    },
  });
  const { done, clients } = prepare(coordinator, [worker]);
  const { isPrepared } = await done;
  assert.equal(await isPrepared.get(clients[0]), false);
  let messages = 0;
  control?.addEventListener('message', () => {
    messages += 1;
  });
  control?.start();
  await settle();
  assert.equal(messages, 0);
  control?.close();
});

test('a worker that waits for others says so', async () => {
  const { group, workers } = connect(2);
  const reported = new Promise<void>((resolve) => {
    waiting = resolve;
  });
  const [worker] = workers as [ConnectedGroup];
  const pending = worker.exchange([]);
  await reported;
  group.end();
  await assert.rejects(pending, /lost/);
  for (const each of workers) each.close();
});

test('a fault of the input is not prepared again', async () => {
  const coordinator = new FakeWorker({
    prepare: () => {
      throw { code: 'recover-mismatch', message: 'shots[3]' };
    },
  });
  await assert.rejects(prepare(coordinator, [new FakeWorker()]).done, { code: 'recover-mismatch' });
  assert.equal(coordinator.log.filter((method) => method === 'prepare').length, 1);
});
