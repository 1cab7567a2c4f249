export default {
  output: 'export',
  reactStrictMode: true,
  // Not a folder above, which has a lock file too.
  turbopack: { root: import.meta.dirname },
};
