//! What the tests of the door share.

use drivescope_drive::parts::{Part, parts};
use drivescope_simulation::{named, simulate};
use drivescope_wasm::Session;
use js_sys::{Float64Array, Reflect};
use wasm_bindgen::prelude::*;

/// A member of an object.
pub fn get(object: &JsValue, key: &str) -> JsValue {
    Reflect::get(object, &key.into()).unwrap()
}

/// What a refusal says.
pub fn text(error: JsError) -> String {
    get(&JsValue::from(error), "message").as_string().unwrap()
}

/// A session with a built-in drive, handed over as the page does.
pub fn with(drive: &str) -> Session {
    let (head, parts) = parts(simulate(&named(drive).unwrap(), None).unwrap());
    let mut session = Session::new();
    let opened =
        session.begin_parts(head.name, head.vehicle, head.rear_axle, head.unix_zero, JsValue::UNDEFINED, head.disk);
    opened.map_err(text).unwrap();
    for Part { name, time, columns } in parts {
        let (names, columns) = columns.iter().map(|(n, c)| (n.to_string(), Float64Array::from(c.as_slice()))).unzip();
        session.add_part(name, names, time, columns).map_err(text).unwrap();
    }
    session.end_parts().map_err(text).unwrap();
    session
}
