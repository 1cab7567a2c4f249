/** Style sheets come into bundles as their text, made small. */
declare module '*.css' {
  const text: string;
  export default text;
}
