// Files that bundle.js includes: drawings and markup as text, pictures as data addresses.

declare module '*.svg' {
  const text: string;
  export default text;
}
declare module '*.html' {
  const text: string;
  export default text;
}
declare module '*.jpg' {
  const address: string;
  export default address;
}
declare module '*.png' {
  const address: string;
  export default address;
}

/** The worker's script. */
declare const WORKER: string;
/** The core as a WebAssembly module, compressed by gzip, in base64. */
declare const CORE: string;
/** The style sheet. */
declare const STYLE: string;
