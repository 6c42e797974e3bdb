/** Stands in for the package that wasm-bindgen writes into `generated/`, where it has not been written yet. */
declare module '*/generated/drivescope_wasm.js' {
  export class Session {}
  export default function init(): Promise<unknown>;
}
