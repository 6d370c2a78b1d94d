//! The control socket as its clients meet it.

use super::*;

const PATIENCE: Option<Duration> = Some(Duration::from_secs(5));

fn answered(client: &mut ControlClient, line: &str) -> String {
    client.send(line).unwrap();
    client.receive(PATIENCE).unwrap()
}

#[test]
fn each_line_is_answered_to_the_client_that_sent_it() {
    let served = serve();
    let (mut one, mut other) = (served.control(), served.control());
    for round in 0..20 {
        one.send(&format!("one {round}")).unwrap();
        assert_eq!(answered(&mut other, "other"), "other");
        assert_eq!(one.receive(PATIENCE).unwrap(), format!("one {round}"));
    }
}

#[test]
fn lines_may_come_in_pieces_or_together_and_end_as_on_windows() {
    let served = serve();
    let mut stream = UnixStream::connect(&served.control).unwrap();
    stream.set_read_timeout(PATIENCE).unwrap();
    stream.write_all(b"fi").unwrap();
    std::thread::sleep(Duration::from_millis(20));
    stream.write_all("rst µ\nsecond\r\nthi".as_bytes()).unwrap();
    let mut answers = [0; 16];
    stream.read_exact(&mut answers).unwrap();
    assert_eq!(answers, *"first µ\nsecond\n".as_bytes());
}

#[test]
fn bytes_that_are_no_text_are_refused_and_harm_nobody() {
    let served = serve();
    let mut stream = UnixStream::connect(&served.control).unwrap();
    stream.set_read_timeout(PATIENCE).unwrap();
    stream.write_all(b"\xFF\xFE\0\nafter\n").unwrap();
    let mut answers = [0; 14];
    stream.read_exact(&mut answers).unwrap();
    assert_eq!(answers, *b"NotUtf8\nafter\n");
    assert_eq!(value(&mut served.tcp(), echo(1)), 1);
}

#[test]
fn a_line_of_64_kib_is_taken_and_a_longer_one_ends_the_connection() {
    let served = serve();
    let longest = "x".repeat(MAX_CONTROL_LINE);
    assert_eq!(answered(&mut served.control(), &longest), longest);

    let mut client = served.control();
    // The connection may end before all of it has been sent.
    let _ = client.send(&format!("{longest}x"));
    let answer = client.receive(PATIENCE);
    assert!(
        matches!(&answer, Ok(line) if line == "TooLong")
            || matches!(answer, Err(ControlClientError::Closed)),
        "{answer:?}"
    );
    assert!(matches!(client.receive(PATIENCE), Err(ControlClientError::Closed)));
    assert_eq!(answered(&mut served.control(), "still here"), "still here");
}

#[test]
fn a_client_that_does_not_read_is_dropped() {
    let served = serve();
    let mut slow = served.control();
    slow.send("flood").unwrap();
    let mut other = served.control();
    assert_eq!(answered(&mut other, "still here"), "still here");
    // Whatever the system kept of the answer, its end never comes.
    assert!(matches!(slow.receive(PATIENCE), Err(ControlClientError::Closed)));
}

#[test]
fn watchers_are_told_without_asking_and_others_are_not() {
    let served = serve();
    let (mut watcher, mut other) = (served.control(), served.control());
    assert_eq!(answered(&mut watcher, "watch"), "");
    assert_eq!(watcher.receive(PATIENCE).unwrap(), "looked");
    assert_eq!(value(&mut served.tcp(), echo(1)), 1);
    assert_eq!(watcher.receive(PATIENCE).unwrap(), "looked");
    assert!(matches!(
        other.receive(Some(Duration::from_millis(50))),
        Err(ControlClientError::Timeout(_))
    ));
}

#[test]
fn the_ninth_client_is_closed_and_a_free_place_is_used_again() {
    let served = serve();
    let mut clients: Vec<ControlClient> =
        (0..MAX_CONTROL_CLIENTS).map(|_| served.control()).collect();
    for client in &mut clients {
        assert_eq!(answered(client, "here"), "here");
    }
    assert!(matches!(served.control().receive(PATIENCE), Err(ControlClientError::Closed)));
    clients.pop();
    // The server may see the new connection before the end of the old one.
    let comes_in = || {
        let mut client = served.control();
        client.send("here").is_ok() && client.receive(PATIENCE).is_ok()
    };
    assert!((0..50).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        comes_in()
    }));
}

#[test]
fn clients_that_vanish_harm_nobody() {
    let served = serve();
    for _ in 0..40 {
        let mut leaving = served.control();
        leaving.send("watch").unwrap();
        leaving.send("flood").unwrap();
        drop(leaving);
        assert_eq!(value(&mut served.tcp(), echo(3)), 3);
    }
    assert_eq!(answered(&mut served.control(), "still here"), "still here");
}

#[test]
fn a_server_with_a_control_client_at_rest_is_never_woken() {
    let served = serve();
    let mut client = served.control();
    assert_eq!(answered(&mut client, "here"), "here");
    std::thread::sleep(Duration::from_millis(20));
    let before = served.advanced.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(served.advanced.load(Ordering::Relaxed), before);
}

#[test]
fn waiting_for_events_allocates_nothing() {
    let file = File::open("/dev/null").unwrap();
    let mut fds: Vec<PollFd<'_>> = Vec::with_capacity(64);
    fds.push(PollFd::new(&file, PollFlags::IN));
    let memory = fds.as_ptr() as usize;
    let again: Vec<PollFd<'_>> = recycled(fds);
    assert!(again.is_empty());
    assert_eq!((again.as_ptr() as usize, again.capacity()), (memory, 64));
}
