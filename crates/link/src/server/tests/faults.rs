//! Faults of the lines as clients meet them.

use super::*;

const SHORT: Duration = Duration::from_millis(100);

fn frame(value: i32) -> [u8; FRAME_LEN] {
    encode_request(1, echo(value))
}

fn answer(value: i32) -> [u8; FRAME_LEN] {
    encode_reply(2, 1, Reply { status: Status::OK, number: 6, value })
}

#[test]
fn a_line_that_drops_every_reply_lets_the_requests_through() {
    let served = serve_faulty("drop=1");
    for mut client in [served.pty(), served.tcp()] {
        client.set_timeout(SHORT);
        let error = client.request(1, echo(1)).unwrap_err();
        assert!(matches!(error, ConnectionError::Timeout(_)), "{error}");
    }
    let mut control = served.control();
    control.send("counts").unwrap();
    assert_eq!(control.receive(None).unwrap(), "[1, 1]");
}

#[test]
fn a_line_that_drops_every_request_is_silent_and_the_module_sees_nothing() {
    let served = serve_faulty("requests.drop=1");
    for mut client in [served.pty(), served.tcp()] {
        client.set_timeout(SHORT);
        let error = client.request(1, echo(1)).unwrap_err();
        assert!(matches!(error, ConnectionError::Timeout(_)), "{error}");
    }
    let mut control = served.control();
    control.send("counts").unwrap();
    // No reply was there to be dropped.
    assert_eq!(control.receive(None).unwrap(), "[0, 0]");
}

#[test]
fn a_damaged_request_is_answered_as_one() {
    // A checksum finds each change of a single byte.
    let served = serve_faulty("requests.corrupt=1");
    for mut client in [served.pty(), served.tcp()] {
        let reply = client.request(1, echo(1)).unwrap();
        assert_eq!(reply.status, Status::WRONG_CHECKSUM);
    }
}

#[test]
fn a_truncated_request_is_forgotten_after_a_silence() {
    let served = serve_faulty("requests.truncate=1");
    let mut client = served.tcp();
    client.set_timeout(SHORT);
    for _ in 0..3 {
        assert!(client.request(1, echo(1)).is_err());
    }
    let mut control = served.control();
    control.send("faults none").unwrap();
    control.receive(None).unwrap();
    std::thread::sleep(SILENCE);
    assert_eq!(value(&mut client, echo(2)), 2);
}

#[test]
fn a_duplicated_request_is_done_twice() {
    let served = serve_faulty("requests.duplicate=1");
    let mut stream = served.socket();
    stream.write_all(&frame(3)).unwrap();
    let mut replies = [0; 2 * FRAME_LEN];
    stream.read_exact(&mut replies).unwrap();
    assert_eq!(replies, *[answer(3); 2].concat());
}

#[test]
fn stray_bytes_come_before_the_reply() {
    let served = serve_faulty("stray=1");
    let mut stream = served.socket();
    stream.write_all(&frame(3)).unwrap();
    let mut replies = Vec::new();
    stream.set_read_timeout(Some(SHORT)).unwrap();
    stream.read_to_end(&mut replies).unwrap_err();
    assert!((10..=13).contains(&replies.len()), "{replies:02X?}");
    assert!(replies.ends_with(&answer(3)), "{replies:02X?}");
}

#[test]
fn stale_replies_are_those_to_the_request_before_on_the_same_connection() {
    let served = serve_faulty("stale=1");
    let (mut one, mut other) = (served.socket(), served.socket());
    one.write_all(&frame(1)).unwrap();
    other.write_all(&frame(100)).unwrap();
    for round in 2..5 {
        for (stream, first) in [(&mut one, 0), (&mut other, 99)] {
            stream.write_all(&frame(first + round)).unwrap();
            let mut reply = [0; FRAME_LEN];
            stream.read_exact(&mut reply).unwrap();
            assert_eq!(reply, answer(first + round - 1));
        }
    }
}

#[test]
fn delayed_frames_come_late_and_in_order() {
    let delay = Duration::from_millis(50);
    for (faults, expected) in [
        ("delay=50ms", delay),
        ("requests.delay=50ms", delay),
        ("delay=50ms,requests.delay=50ms", delay * 2),
    ] {
        let served = serve_faulty(faults);
        for mut client in [served.pty(), served.tcp()] {
            let start = std::time::Instant::now();
            client.send(&[frame(1), frame(2)].concat()).unwrap();
            for value in 1..=2 {
                let reply = client.receive(Duration::from_secs(5)).unwrap();
                assert_eq!(reply, Some(answer(value)));
                assert!(start.elapsed() >= expected, "{faults}: {:?}", start.elapsed());
            }
        }
    }
}

#[test]
fn a_delay_is_real_time_whatever_the_speed() {
    let served = start(100.0, "delay=50ms".parse().unwrap(), |_| {});
    let begin = std::time::Instant::now();
    assert_eq!(value(&mut served.tcp(), echo(1)), 1);
    assert!(begin.elapsed() >= Duration::from_millis(50), "{:?}", begin.elapsed());
}

#[test]
fn a_server_with_faulty_lines_at_rest_is_never_woken() {
    let served = serve_faulty("delay=20ms,requests.delay=20ms,stale=0.5,requests.stale=0.5");
    let mut client = served.tcp();
    client.send(&frame(1)).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let before = served.advanced.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(served.advanced.load(Ordering::Relaxed), before);
}

#[test]
fn the_same_conversation_meets_the_same_faults() {
    let spec = "drop=0.2,corrupt=0.2,truncate=0.2,requests.drop=0.2,seed=11";
    let run = || -> Vec<u8> {
        let served = serve_faulty(spec);
        let mut stream = served.socket();
        let requests: Vec<u8> = (0..100).flat_map(frame).collect();
        stream.write_all(&requests).unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
        let mut replies = Vec::new();
        stream.read_to_end(&mut replies).unwrap_err();
        replies
    };
    let first = run();
    assert!(!first.is_empty());
    assert_eq!(run(), first);
}
