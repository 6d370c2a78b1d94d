//! Connections in ASCII mode, which send text and no frames.

use super::*;
use serial2::SerialPort;

const PATIENCE: Duration = Duration::from_secs(5);
const SHORT: Duration = Duration::from_millis(100);
const ASCII: Command = Command::new(control::ASCII_MODE, 0, 0, 0);

/// What carries bytes to the server and back.
trait Keyboard {
    fn type_in(&mut self, bytes: &[u8]);
    /// Exactly so many bytes.
    fn shown(&mut self, count: usize) -> Vec<u8>;
    /// What comes within a short time.
    fn rest(&mut self) -> Vec<u8>;
}

impl Keyboard for TcpStream {
    fn type_in(&mut self, bytes: &[u8]) {
        self.write_all(bytes).unwrap();
    }

    fn shown(&mut self, count: usize) -> Vec<u8> {
        let mut bytes = vec![0; count];
        self.set_read_timeout(Some(PATIENCE)).unwrap();
        self.read_exact(&mut bytes).unwrap();
        bytes
    }

    fn rest(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.set_read_timeout(Some(SHORT)).unwrap();
        self.read_to_end(&mut bytes).unwrap_err();
        bytes
    }
}

impl Keyboard for SerialPort {
    fn type_in(&mut self, bytes: &[u8]) {
        self.write_all(bytes).unwrap();
    }

    fn shown(&mut self, count: usize) -> Vec<u8> {
        let mut bytes = vec![0; count];
        self.set_read_timeout(PATIENCE).unwrap();
        self.read_exact(&mut bytes).unwrap();
        bytes
    }

    fn rest(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.set_read_timeout(SHORT).unwrap();
        self.read_to_end(&mut bytes).unwrap_err();
        bytes
    }
}

impl Served {
    fn terminal(&self) -> SerialPort {
        SerialPort::open(&self.path, 9600).unwrap()
    }

    /// The pseudo terminal and a socket.
    fn both(&self) -> [Box<dyn Keyboard>; 2] {
        [Box::new(self.terminal()), Box::new(self.socket())]
    }

    fn tell(&self, line: &str) -> String {
        let mut control = self.control();
        control.send(line).unwrap();
        control.receive(None).unwrap()
    }
}

fn request(value: i32) -> [u8; FRAME_LEN] {
    encode_request(1, echo(value))
}

fn answer(command: Command) -> [u8; FRAME_LEN] {
    let Command { number, value, .. } = command;
    encode_reply(2, 1, Reply { status: Status::OK, number, value })
}

fn enter(client: &mut (impl Keyboard + ?Sized)) {
    client.type_in(&encode_request(1, ASCII));
    assert_eq!(client.shown(FRAME_LEN), answer(ASCII));
}

#[test]
fn keys_are_given_to_the_device_one_by_one_as_they_are_typed() {
    let served = serve();
    for mut client in served.both() {
        enter(&mut *client);
        for key in b"AMST 0" {
            client.type_in(&[*key]);
            assert_eq!(client.shown(1), [*key]);
        }
        client.type_in(b"\r");
        assert_eq!(client.shown(2), b"\r!");
    }
}

#[test]
fn the_mode_may_change_between_two_bytes_of_one_write() {
    let served = serve();
    for mut client in served.both() {
        // The text has the length of two frames, and the last frame comes in binary mode.
        let asked = [
            &request(1)[..],
            &encode_request(1, ASCII),
            b"123456789abcde\r",
            b"BIN\r",
            &request(2),
            &encode_request(1, ASCII),
            b"x\r",
        ];
        client.type_in(&asked.concat());
        let expected = [
            &answer(echo(1))[..],
            &answer(ASCII),
            b"123456789abcde\r!",
            b"BIN\r!",
            &answer(echo(2)),
            &answer(ASCII),
            b"x\r!",
        ];
        assert_eq!(client.shown(expected.concat().len()), expected.concat());
        assert_eq!(client.rest(), b"");
    }
}

#[test]
fn a_connection_in_ascii_mode_leaves_the_others_in_binary_mode() {
    let served = serve();
    let (mut text, mut frames, mut pty) = (served.socket(), served.socket(), served.terminal());
    enter(&mut text);
    for round in 0..5 {
        text.type_in(b"AM");
        for other in [&mut frames as &mut dyn Keyboard, &mut pty] {
            other.type_in(&request(round));
            assert_eq!(other.shown(FRAME_LEN), answer(echo(round)));
        }
        text.type_in(b"ST\r");
        assert_eq!(text.shown(6), b"AMST\r!");
    }
}

#[test]
fn the_stray_end_of_the_line_bin_is_forgotten_after_a_silence() {
    let served = serve();
    for mut client in served.both() {
        enter(&mut *client);
        client.type_in(b"BIN\r\n");
        assert_eq!(client.shown(5), b"BIN\r!");
        std::thread::sleep(SILENCE);
        client.type_in(&request(1));
        assert_eq!(client.shown(FRAME_LEN), answer(echo(1)));
    }
}

#[test]
fn text_meets_no_faults_and_is_not_counted() {
    let served = serve();
    for (mut client, counts) in
        served.both().into_iter().zip(["[(2, 0), (0, 0)]", "[(0, 0), (2, 0)]"])
    {
        enter(&mut *client);
        served.tell(
            "faults corrupt=1,truncate=1,duplicate=1,stray=1,delay=5000ms,requests.corrupt=1",
        );
        client.type_in(b"AMST 0\r");
        assert_eq!(client.shown(8), b"AMST 0\r!");
        served.tell("faults drop=1,requests.drop=1");
        client.type_in(b"BIN\r");
        assert_eq!(client.shown(5), b"BIN\r!");
        client.type_in(&[request(1), request(2)].concat());
        assert_eq!(client.rest(), b"");
        assert_eq!(served.tell("frames"), counts);
        served.tell("faults none");
    }
}

#[test]
fn text_does_not_overtake_a_late_frame() {
    let served = serve_faulty("delay=50ms");
    for mut client in served.both() {
        client.type_in(&encode_request(1, ASCII));
        client.type_in(b"AMST 0\r");
        assert_eq!(client.shown(FRAME_LEN), answer(ASCII));
        assert_eq!(client.shown(8), b"AMST 0\r!");
    }
}

#[test]
fn keys_do_not_overtake_what_is_late() {
    let served = serve_faulty("requests.delay=50ms");
    for mut client in served.both() {
        client.type_in(&encode_request(1, ASCII));
        std::thread::sleep(Duration::from_millis(30));
        client.type_in(b"AMST 0 1\r");
        // The reply comes some 30 ms before that line reaches the device; on a slow machine, later.
        assert_eq!(client.shown(FRAME_LEN), answer(ASCII));
        client.type_in(b"x\r");
        assert_eq!(client.shown(13), b"AMST 0 1\r!x\r!");
    }
}

#[test]
fn a_line_that_is_late_carries_what_was_sent_before_the_mode_changed() {
    let served = serve_faulty("requests.delay=50ms");
    for mut client in served.both() {
        let start = std::time::Instant::now();
        // The text fills a frame of the line, which still carries frames when it is sent.
        client.type_in(&[&encode_request(1, ASCII)[..], b"AMST 0 1\r"].concat());
        assert_eq!(client.shown(FRAME_LEN), answer(ASCII));
        assert_eq!(client.shown(10), b"AMST 0 1\r!");
        assert!(start.elapsed() >= Duration::from_millis(50), "{:?}", start.elapsed());
        client.type_in(b"AB\r");
        assert_eq!(client.shown(4), b"AB\r!");
    }
}

#[test]
fn the_device_is_told_which_connection_has_ended() {
    let served = serve();
    let mut first = served.socket();
    let mut second = served.socket();
    enter(&mut first);
    enter(&mut second);
    drop(first);
    // The second is served after the end of the first has been seen.
    let is_told = || served.ended.lock().unwrap().clone();
    let told = (0..500).find_map(|_| {
        std::thread::sleep(Duration::from_millis(10));
        Some(is_told()).filter(|told| !told.is_empty())
    });
    let peer = Peer { module: 0, endpoint: Endpoint::Tcp, number: 0 };
    assert_eq!(told, Some(vec![peer]));
    second.type_in(b"x\r");
    assert_eq!(second.shown(3), b"x\r!");
}

#[test]
fn the_next_client_of_the_pseudo_terminal_finds_its_mode() {
    let served = serve();
    let mut client = served.terminal();
    enter(&mut client);
    drop(client);
    let mut next = served.terminal();
    next.type_in(b"x\r");
    assert_eq!(next.shown(3), b"x\r!");
    assert_eq!(*served.ended.lock().unwrap(), []);
}

#[test]
fn a_server_with_text_on_its_lines_at_rest_is_never_woken() {
    let served = serve_faulty("delay=20ms");
    let mut client = served.socket();
    enter(&mut client);
    client.type_in(b"AMST");
    assert_eq!(client.shown(4), b"AMST");
    std::thread::sleep(Duration::from_millis(100));
    let before = served.advanced.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(served.advanced.load(Ordering::Relaxed), before);
}
