/** Starts workers on pages that allow script addresses only from policies (Trusted Types). */

/** The name of the policy, for the `trusted-types` directive. */
const POLICY = 'relightable-photo';

interface TrustedTypesPolicy {
  createScriptURL(url: string): string;
}

const { trustedTypes } = globalThis as {
  trustedTypes?: {
    createPolicy(name: string, rules: TrustedTypesPolicy): TrustedTypesPolicy;
  };
};

/** Made once: a page may forbid a second policy of the same name. */
let policy: TrustedTypesPolicy | undefined;

/** Calls `create`, which calls `new Worker` with a literal address of this package, for bundlers. */
export function createTrustedWorker(create: () => Worker): Worker {
  try {
    policy ??= trustedTypes?.createPolicy(POLICY, { createScriptURL: (url) => url });
  } catch {
    // The page does not list the policy, but may have a default one, or require none.
  }
  if (!policy) return create();
  const trusted = policy;
  const { Worker } = globalThis;
  // Bundlers recognise only `new Worker(new URL(…))`, which leaves no place for the policy but the class itself.
  globalThis.Worker = class extends Worker {
    constructor(url: string | URL, options?: WorkerOptions) {
      super(trusted.createScriptURL(String(url)), options);
    }
  };
  try {
    return create();
  } finally {
    globalThis.Worker = Worker;
  }
}
