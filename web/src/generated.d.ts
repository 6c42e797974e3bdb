/** Stand in for the packages that wasm-bindgen writes into `generated/`, where they have not been written yet. */
declare module '*/generated/drivescope_wasm.js' {
  export class Session {}
  export default function init(): Promise<unknown>;
}
declare module '*/generated/drivescope_drives.js' {
  export class Simulator {}
  export default function init(): Promise<unknown>;
}
declare module '*/generated/drivescope_doctor.js' {
  export class Doctor {}
  export default function init(): Promise<unknown>;
}
declare module '*/generated/drivescope_gallery.js' {
  export class Attempt {
    constructor(id: string);
  }
  export class DrivenLoop {
    constructor(name: string, settings: object, seed: number);
  }
  export function loop_catalogue(): unknown;
  export function paper_catalogue(): unknown;
  export default function init(): Promise<unknown>;
}
declare module '*/generated/drivescope_readers.js' {
  export class Reader {}
  export function role(file: File): string;
  export function __wbg_reset_state(): void;
  export default function init(): Promise<unknown>;
}
