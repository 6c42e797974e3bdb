//! The file server, over a real connection.

use super::*;

/// A folder with a page and, beside it, a file that must not be served; and a server for the former.
fn served(name: &str) -> String {
    let folder = std::env::temp_dir().join(format!("drivescope-serve-{}-{name}", std::process::id()));
    let root = folder.join("page");
    std::fs::create_dir_all(root.join("assets")).unwrap();
    std::fs::write(folder.join("secret.txt"), "secret").unwrap();
    std::fs::write(root.join("index.html"), "<p>page").unwrap();
    std::fs::write(root.join("assets/a b.wasm"), b"\0asm").unwrap();
    let listener = listen(20_000).unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || answer(&listener, move |request| file(&root, request)));
    address
}

fn ask(address: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

fn get(address: &str, target: &str) -> String {
    ask(address, &format!("GET {target} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"))
}

#[test]
fn the_page_has_its_type_and_is_not_cached() {
    let page = get(&served("page"), "/?lang=en");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
    assert!(page.contains("Content-Type: text/html; charset=utf-8\r\n"), "{page}");
    assert!(page.contains("Cache-Control: no-cache\r\n"), "{page}");
    assert!(page.ends_with("<p>page"), "{page}");
}

#[test]
fn webassembly_has_the_type_that_streaming_needs() {
    let wasm = get(&served("wasm"), "/assets/a%20b.wasm");
    assert!(wasm.contains("Content-Type: application/wasm\r\n"), "{wasm}");
}

#[test]
fn nothing_outside_the_folder_is_served() {
    let address = served("outside");
    for target in [
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/assets/..%2f..%2fsecret.txt",
        "/..%5csecret.txt",
        "//../secret.txt",
        "/%",
    ] {
        let answer = get(&address, target);
        assert!(answer.starts_with("HTTP/1.1 404"), "{target}: {answer}");
        assert!(!answer.contains("secret"), "{target}: {answer}");
    }
}

#[test]
fn a_folder_is_asked_for_with_a_slash() {
    let answer = get(&served("folder"), "/assets");
    assert!(answer.contains("301") && answer.contains("Location: /assets/\r\n"), "{answer}");
}

#[test]
fn other_methods_and_nonsense_are_refused() {
    let address = served("methods");
    assert!(ask(&address, "PUT / HTTP/1.0\r\n\r\n").starts_with("HTTP/1.1 405"));
    assert!(ask(&address, "hello\r\n\r\n").starts_with("HTTP/1.1 400"));
    let head = ask(&address, "HEAD / HTTP/1.0\r\n\r\n");
    assert!(head.contains("Content-Length: 7\r\n") && head.ends_with("\r\n\r\n"), "{head}");
}

#[test]
fn one_connection_carries_two_requests() {
    let both = ask(&served("keep"), "GET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\nConnection: close\r\n\r\n");
    assert_eq!(both.matches("<p>page").count(), 2, "{both}");
}

#[test]
fn a_taken_port_gives_the_next_free_one() {
    let first = listen(21_000).unwrap();
    let second = listen(first.local_addr().unwrap().port()).unwrap();
    assert!(second.local_addr().unwrap().port() > first.local_addr().unwrap().port());
}
