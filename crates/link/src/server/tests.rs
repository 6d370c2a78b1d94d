use super::*;
use crate::connection::{Client, Connection, ConnectionError};
use crate::control::{ControlClient, ControlClientError, MAX_CONTROL_CLIENTS, MAX_CONTROL_LINE};
use crate::faults::Fault;
use crate::uri::{PortUri, Uri};
use opentmcl_wire::ascii::Text;
use opentmcl_wire::serial::{FRAME_LEN, decode_reply, encode_reply, encode_request};
use opentmcl_wire::{Command, Reply, Status, control};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Answers with the value of the request; what else it does depends on the command number.
struct Echo {
    now: Instant,
    /// When it next wants to be advanced, and how often after that.
    alarm: Option<Instant>,
    period: u64,
    /// Real time that advancing takes for each second of its own, and until when.
    slowness: f64,
    slow_until: Instant,
    replies: VecDeque<(Instant, Peer, Outgoing)>,
    advanced: Arc<AtomicU64>,
    /// Clients of the control socket that want to know of every request.
    watchers: Vec<u8>,
    /// Who sends text, each with what has come of a line.
    texts: Vec<(Peer, Vec<u8>)>,
    ended: Arc<Mutex<Vec<Peer>>>,
}

/// Replies with the device's time in microseconds.
const TELL_TIME: u8 = 200;
/// Replies after `value` microseconds.
const REPLY_LATER: u8 = 201;
/// Replies at once, and again with status 128 after `value` microseconds.
const REPLY_TWICE: u8 = control::POSITION_REPORT;
/// Replies with the number of the connection.
const TELL_PEER: u8 = 202;

/// A pause after which a receiver expects a new frame, with much to spare: on a busy machine the
/// server may wake up late and see less of it.
const SILENCE: Duration = Duration::from_millis(100);

fn micros(count: u64) -> opentmcl_wire::Duration {
    opentmcl_wire::Duration::from_micros(count)
}

impl Device for Echo {
    fn next_event(&mut self) -> Option<Instant> {
        self.replies.iter().map(|&(due, ..)| due).chain(self.alarm).min()
    }

    fn advance_to(&mut self, now: Instant) {
        self.advanced.fetch_add(1, Ordering::Relaxed);
        let Some(span) = now.checked_duration_since(self.now) else { return };
        if self.now < self.slow_until {
            std::thread::sleep(Duration::from_micros(span.as_micros()).mul_f64(self.slowness));
        }
        self.now = now;
        while let Some(alarm) = self.alarm.filter(|&alarm| alarm <= now) {
            self.alarm = Some(alarm + micros(self.period));
        }
    }

    fn receive(&mut self, from: Peer, request: Result<Request, WrongChecksum>) {
        let mut due = self.now;
        let reply = match request {
            Err(_) => Reply { status: Status::WRONG_CHECKSUM, number: 0, value: 0 },
            Ok(Request { command, .. }) => {
                let value = match command.number {
                    TELL_TIME => self.now.duration_since_epoch().as_micros() as i32,
                    TELL_PEER => i32::from(from.number),
                    _ => command.value,
                };
                if command.number == REPLY_LATER {
                    due += micros(command.value as u64);
                }
                Reply { status: Status::OK, number: command.number, value }
            }
        };
        self.replies.push_back((due, from, Outgoing::Frame(encode_reply(2, 1, reply))));
        if reply.number == control::ASCII_MODE {
            self.texts.push((from, Vec::new()));
        }
        if reply.number == REPLY_TWICE {
            let second = Reply { status: Status::DELAYED, ..reply };
            let due = self.now + micros(reply.value as u64);
            self.replies.push_back((due, from, Outgoing::Frame(encode_reply(2, 1, second))));
        }
    }

    fn takes_text(&self, from: Peer) -> bool {
        self.texts.iter().any(|(peer, _)| *peer == from)
    }

    /// Echoes each key; a line ends with CR and is answered by `!`. The line BIN is the last.
    fn receive_key(&mut self, from: Peer, byte: u8) {
        let (_, line) = self.texts.iter_mut().find(|(peer, _)| *peer == from).unwrap();
        line.push(byte);
        let is_last = line == b"BIN\r";
        let mut text = Text::new();
        text.push(&[byte]);
        if byte == b'\r' {
            line.clear();
            text.push(b"!");
        }
        self.replies.push_back((self.now, from, Outgoing::Text(text)));
        if is_last {
            self.texts.retain(|(peer, _)| *peer != from);
        }
    }

    fn connection_ended(&mut self, peer: Peer) {
        self.texts.retain(|(other, _)| *other != peer);
        self.ended.lock().unwrap().push(peer);
    }

    /// Says the line again; some words have a meaning.
    fn control(
        &mut self,
        client: u8,
        line: Result<&str, BadLine>,
        ports: &mut [ServedPort],
        answer: &mut String,
    ) {
        match line {
            Ok("watch") => self.watchers.push(client),
            // Far more than the system takes from a server whose client does not read.
            Ok("flood") => answer.push_str(&"x".repeat(1 << 20)),
            Ok("counts") => {
                let dropped = |port: &ServedPort| port.reply_counts()[Fault::Drop];
                let counts: Vec<u64> = ports.iter().map(dropped).collect();
                answer.push_str(&format!("{counts:?}"));
            }
            Ok("frames") => {
                let frames =
                    |port: &ServedPort| (port.request_counts().frames, port.reply_counts().frames);
                let counts: Vec<_> = ports.iter().map(frames).collect();
                answer.push_str(&format!("{counts:?}"));
            }
            Ok(line) => match line.strip_prefix("faults ").map(str::parse::<Faults>) {
                Some(Ok(faults)) => ports.iter_mut().for_each(|port| port.set_faults(faults)),
                _ => answer.push_str(line),
            },
            Err(error) => answer.push_str(&format!("{error:?}")),
        }
        answer.push('\n');
    }

    fn control_ended(&mut self, client: u8) {
        self.watchers.retain(|&watcher| watcher != client);
    }

    fn report(&mut self, client: u8, lines: &mut String) {
        if self.watchers.contains(&client) {
            lines.push_str("looked\n");
        }
    }

    fn transmit(&mut self) -> Option<(Peer, Outgoing)> {
        let at = self.replies.iter().position(|&(due, ..)| due <= self.now)?;
        self.replies.remove(at).map(|(_, peer, content)| (peer, content))
    }
}

/// Servers in threads of their own, stopped at the end of the test.
struct Served {
    path: std::path::PathBuf,
    address: std::net::SocketAddr,
    control: std::path::PathBuf,
    advanced: Arc<AtomicU64>,
    ended: Arc<Mutex<Vec<Peer>>>,
    stop: Option<UnixStream>,
    thread: Option<std::thread::JoinHandle<io::Result<()>>>,
    _folder: tempfile::TempDir,
}

fn serve_with(speed: f64, prepare: impl FnOnce(&mut Echo)) -> Served {
    start(speed, Faults::default(), prepare)
}

fn serve() -> Served {
    serve_with(1.0, |_| {})
}

/// Both lines have these faults.
fn serve_faulty(faults: &str) -> Served {
    start(1.0, faults.parse().unwrap(), |_| {})
}

fn start(speed: f64, faults: Faults, prepare: impl FnOnce(&mut Echo)) -> Served {
    let pty = Pty::open(None).unwrap();
    let listener = Listener::bind("127.0.0.1").unwrap();
    let (path, address) = (pty.path().to_owned(), listener.address());
    let folder = tempfile::tempdir().unwrap();
    let control = folder.path().join("control");
    let socket = ControlSocket::bind(&control).unwrap();
    let advanced = Arc::new(AtomicU64::new(0));
    let ended = Arc::default();
    let mut device = Echo {
        now: Instant::from_ticks(0),
        alarm: None,
        period: 0,
        slowness: 0.0,
        slow_until: Instant::from_ticks(u64::MAX),
        replies: VecDeque::new(),
        advanced: Arc::clone(&advanced),
        watchers: Vec::new(),
        texts: Vec::new(),
        ended: Arc::clone(&ended),
    };
    prepare(&mut device);
    let (stop, stopped) = UnixStream::pair().unwrap();
    let port = |name: &str, transport| NewPort { module: 0, name: name.into(), transport, faults };
    let ports = vec![port("pty", Transport::Pty(pty)), port("tcp", Transport::Tcp(listener))];
    let mut server = Server::new(device, ports, Some(socket));
    let speed = Speed::new(speed).unwrap();
    let thread = std::thread::spawn(move || server.run(stopped, speed));
    let (stop, thread) = (Some(stop), Some(thread));
    Served { path, address, control, advanced, ended, stop, thread, _folder: folder }
}

impl Served {
    fn tcp(&self) -> Client {
        let host = self.address.ip().to_string();
        Client::open(&PortUri::Tcp { host, port: self.address.port() }).unwrap()
    }

    fn socket(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream
    }

    fn pty(&self) -> Client {
        Client::open(&PortUri::Serial { path: self.path.clone(), baud: 9600 }).unwrap()
    }

    fn control(&self) -> ControlClient {
        ControlClient::open(&self.control).unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.stop.take());
        let ended = self.thread.take().map(|thread| thread.join());
        if !std::thread::panicking() {
            ended.unwrap().unwrap().unwrap();
        }
    }
}

fn echo(value: i32) -> Command {
    Command::new(6, 0, 0, value)
}

#[track_caller]
fn value(client: &mut Client, command: Command) -> i32 {
    let reply = client.request(1, command).unwrap();
    assert_eq!((reply.status, reply.number), (Status::OK, command.number));
    reply.value
}

#[test]
fn clients_on_both_lines_are_answered_at_the_same_time() {
    let served = serve();
    let (mut pty, mut first, mut second) = (served.pty(), served.tcp(), served.tcp());
    for round in 0..20 {
        assert_eq!(value(&mut pty, echo(round)), round);
        assert_eq!(value(&mut first, echo(round + 100)), round + 100);
        assert_eq!(value(&mut second, echo(round + 200)), round + 200);
    }
}

#[test]
fn a_delayed_reply_goes_to_the_connection_that_asked() {
    let served = serve();
    let (mut first, mut second) = (served.tcp(), served.tcp());
    let later = Command::new(REPLY_LATER, 0, 0, 50_000);
    first.send(&encode_request(1, later)).unwrap();
    assert_eq!(value(&mut second, echo(1)), 1);
    assert_eq!(second.receive(Duration::from_millis(1)).unwrap(), None);
    let frame = first.receive(Duration::from_secs(5)).unwrap().unwrap();
    assert_eq!(decode_reply(frame).unwrap().reply.number, REPLY_LATER);
}

#[test]
fn many_requests_in_one_write_are_all_answered_in_order() {
    let served = serve();
    for mut client in [served.pty(), served.tcp()] {
        let requests: Vec<u8> = (0..300).flat_map(|value| encode_request(1, echo(value))).collect();
        client.send(&requests).unwrap();
        for value in 0..300 {
            let frame = client.receive(Duration::from_secs(5)).unwrap().unwrap();
            assert_eq!(decode_reply(frame).unwrap().reply.value, value);
        }
    }
}

#[test]
fn each_connection_has_its_own_decoder() {
    let served = serve();
    let (mut first, mut second) = (served.socket(), served.tcp());
    let frame = encode_request(1, echo(7));
    first.write_all(&frame[..4]).unwrap();
    assert_eq!(value(&mut second, echo(8)), 8);
    // The second half may come too late for the first if this machine is slow; then it is a new
    // beginning, and the next request is answered all the same.
    first.write_all(&frame[4..]).unwrap();
    std::thread::sleep(SILENCE);
    first.write_all(&frame).unwrap();
    let mut reply = [0; FRAME_LEN];
    first.read_exact(&mut reply).unwrap();
    assert_eq!(decode_reply(reply).unwrap().reply.value, 7);
}

#[test]
fn half_a_frame_and_silence_do_not_spoil_the_next_frame() {
    // A silence is real time even if the module lives at a hundredth of the speed.
    for speed in [1.0, 0.01] {
        let served = serve_with(speed, |_| {});
        for mut client in [served.pty(), served.tcp()] {
            client.send(&encode_request(1, echo(1))[..5]).unwrap();
            std::thread::sleep(SILENCE);
            assert_eq!(value(&mut client, echo(2)), 2);
        }
    }
}

#[test]
fn a_short_pause_inside_a_frame_is_none_for_a_fast_module_either() {
    let served = serve_with(1000.0, |_| {});
    let mut client = served.pty();
    assert_eq!(value(&mut client, echo(0)), 0);
    let frame = encode_request(1, echo(1));
    let answers = |_: &i32| {
        client.send(&frame[..5]).unwrap();
        std::thread::sleep(Duration::from_millis(1));
        client.send(&frame[5..]).unwrap();
        let answer = client.receive(Duration::from_millis(50)).unwrap();
        answer == Some(encode_reply(2, 1, Reply { status: Status::OK, number: 6, value: 1 }))
    };
    // On a busy machine a pause of a millisecond may be too long, or none, a few times.
    let answered = (0..20).filter(answers).count();
    assert!(answered > 10, "{answered} of 20");
}

#[test]
fn a_client_that_vanishes_leaves_the_others_alone() {
    let served = serve();
    let mut pty = served.pty();
    let mut staying = served.tcp();
    for _ in 0..40 {
        let mut leaving = served.socket();
        leaving.write_all(&encode_request(1, echo(1))).unwrap();
        leaving.write_all(&[1, 6]).unwrap();
        drop(leaving);
        assert_eq!(value(&mut staying, echo(3)), 3);
        assert_eq!(value(&mut pty, echo(4)), 4);
    }
}

#[test]
fn the_next_client_on_the_pty_gets_its_own_replies() {
    let served = serve();
    for round in 0..5 {
        // Asks more than the line can hold the answers to, reads none, and goes.
        let mut careless = File::options().write(true).open(&served.path).unwrap();
        for value in 0..10_000 {
            careless.write_all(&encode_request(1, echo(value))).unwrap();
        }
        drop(careless);
        let mut client = served.pty();
        // Everything that was sent before has been answered when this silence comes.
        while client.receive(Duration::from_millis(100)).is_ok_and(|frame| frame.is_some()) {}
        for answer in 0..10 {
            assert_eq!(value(&mut client, echo(round * 100 + answer)), round * 100 + answer);
        }
    }
}

#[test]
fn a_tcp_client_that_does_not_read_is_waited_for_asleep() {
    let served = serve();
    let mut writer = served.socket();
    let mut reader = writer.try_clone().unwrap();
    // The replies are more than the system keeps for a client that does not read.
    rustix::net::sockopt::set_socket_recv_buffer_size(&reader, 64 * 1024).unwrap();
    let sending = std::thread::spawn(move || {
        for start in (0..800_000).step_by(1000) {
            let requests: Vec<u8> =
                (start..start + 1000).flat_map(|value| encode_request(1, echo(value))).collect();
            writer.write_all(&requests).unwrap();
        }
        writer
    });
    let mut other = served.tcp();
    assert_eq!(value(&mut other, echo(5)), 5);
    let asleep = (0..100).any(|_| {
        let before = served.advanced.load(Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(100));
        served.advanced.load(Ordering::Relaxed) == before
    });
    assert!(asleep, "it never stops trying");

    // Once it reads, it gets its replies. Later ones may answer parts of frames, where the system
    // held up the rest for more than 5 ms: nobody promises otherwise for so many at once.
    reader.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    let mut replies = Vec::new();
    let ended = reader.read_to_end(&mut replies).unwrap_err();
    assert_eq!(ended.kind(), io::ErrorKind::WouldBlock, "{ended}");
    for (value, reply) in (0..1000).zip(replies.chunks_exact(FRAME_LEN)) {
        assert_eq!(decode_reply(reply.try_into().unwrap()).unwrap().reply.value, value);
    }

    let mut writer = sending.join().unwrap();
    writer.write_all(&encode_request(1, echo(7))).unwrap();
    let mut reply = [0; FRAME_LEN];
    reader.read_exact(&mut reply).unwrap();
    assert_eq!(decode_reply(reply).unwrap().reply.value, 7);
}

#[test]
fn the_seventeenth_connection_is_closed_and_a_free_place_is_used_again() {
    let served = serve();
    let mut clients: Vec<Client> = (0..MAX_CONNECTIONS).map(|_| served.tcp()).collect();
    let numbers: Vec<i32> =
        clients.iter_mut().map(|client| value(client, Command::new(TELL_PEER, 0, 0, 0))).collect();
    assert_eq!(numbers, (0..16).collect::<Vec<i32>>());

    assert_eq!(served.socket().read(&mut [0]).unwrap(), 0);

    clients.pop();
    let mut next = None;
    // The server may see the new connection before the end of the old one.
    for _ in 0..50 {
        let mut client = served.tcp();
        if let Ok(reply) = client.request(1, Command::new(TELL_PEER, 0, 0, 0)) {
            next = Some(reply.value);
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(next, Some(16), "a number is not given to the next client at once");
}

#[test]
fn a_device_at_rest_is_never_woken() {
    let served = serve();
    let mut client = served.tcp();
    assert_eq!(value(&mut client, echo(1)), 1);
    std::thread::sleep(Duration::from_millis(20));
    let before = served.advanced.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(served.advanced.load(Ordering::Relaxed), before);
}

#[test]
fn a_device_that_wants_ten_thousand_wake_ups_a_second_gets_a_thousand() {
    let served = serve_with(1.0, |device| {
        device.alarm = Some(Instant::from_ticks(0));
        device.period = 100;
    });
    std::thread::sleep(Duration::from_millis(20));
    let before = served.advanced.load(Ordering::Relaxed);
    let start = std::time::Instant::now();
    std::thread::sleep(Duration::from_millis(500));
    let woken = served.advanced.load(Ordering::Relaxed) - before;
    let milliseconds = start.elapsed().as_millis() as u64;
    assert!((10..=milliseconds + 2).contains(&woken), "{woken} in {milliseconds} ms");
}

#[test]
fn a_client_does_not_wait_for_the_coalesced_wake_up() {
    let served = serve_with(1.0, |device| {
        device.alarm = Some(Instant::from_ticks(0));
        device.period = 100;
    });
    let mut client = served.tcp();
    let mut fastest = Duration::MAX;
    for round in 0..200 {
        let start = std::time::Instant::now();
        assert_eq!(value(&mut client, echo(round)), round);
        fastest = fastest.min(start.elapsed());
    }
    assert!(fastest < COALESCE, "{fastest:?}");
}

#[test]
fn the_device_lives_in_real_time_multiplied_by_the_speed() {
    for speed in [0.5, 1.0, 100.0] {
        let served = serve_with(speed, |_| {});
        let mut client = served.tcp();
        let ask = Command::new(TELL_TIME, 0, 0, 0);
        let before = std::time::Instant::now();
        let first = value(&mut client, ask);
        let after_first = before.elapsed();
        std::thread::sleep(Duration::from_millis(200));
        let inner = before.elapsed() - after_first;
        let second = value(&mut client, ask);
        let outer = before.elapsed();
        let passed = f64::from(second - first) / speed;
        // Each reply was made at some time between its request and its arrival.
        assert!(passed >= inner.as_micros() as f64 - 1.0, "{speed}: {passed} µs, {inner:?}");
        assert!(passed <= outer.as_micros() as f64 + 1.0, "{speed}: {passed} µs, {outer:?}");
    }
}

#[test]
fn a_device_that_cannot_keep_up_still_answers() {
    let served = serve_with(1.0, |device| {
        device.alarm = Some(Instant::from_ticks(0));
        device.period = 100;
        device.slowness = 3.0;
    });
    std::thread::sleep(Duration::from_secs(2));
    let mut client = served.tcp();
    for round in 0..5 {
        // One slice takes 60 ms of real time, all that is behind would take seconds.
        assert_eq!(value(&mut client, echo(round)), round);
    }
}

#[test]
fn what_a_device_is_behind_by_more_than_a_second_is_lost() {
    let started = std::time::Instant::now();
    let served = serve_with(1.0, |device| {
        device.alarm = Some(Instant::from_ticks(0));
        device.period = 100;
        // After its first 0.3 s, 2.4 s of real time have passed: 1.1 s more than it may be behind.
        device.slowness = 8.0;
        device.slow_until = Instant::from_ticks(0) + micros(300_000);
    });
    std::thread::sleep(Duration::from_secs(3));
    let mut client = served.tcp();
    let time = value(&mut client, Command::new(TELL_TIME, 0, 0, 0));
    let behind = started.elapsed() - Duration::from_micros(time as u64);
    assert!(behind >= Duration::from_millis(1_000), "{behind:?}");
    // What it was behind by less, it has caught up.
    assert!(time > 300_000 + 500_000, "{time} µs");
}

#[test]
fn a_late_second_reply_is_not_taken_for_the_answer_to_the_next_request() {
    let served = serve();
    for mut client in [served.pty(), served.tcp()] {
        assert_eq!(value(&mut client, Command::new(REPLY_TWICE, 0, 0, 20_000)), 20_000);
        // The second reply comes between this request and its own reply.
        assert_eq!(value(&mut client, Command::new(REPLY_LATER, 0, 0, 100_000)), 100_000);
    }
}

#[test]
fn a_serial_port_is_opened_by_one_client_at_a_time() {
    let served = serve();
    let uri = PortUri::Serial { path: served.path.clone(), baud: 115_200 };
    let first = Client::open(&uri).unwrap();
    let error = Client::open(&uri).unwrap_err();
    assert!(matches!(error, ConnectionError::Busy(_)), "{error}");
    drop(first);
    assert_eq!(value(&mut Client::open(&uri).unwrap(), echo(1)), 1);
}

#[test]
fn stale_replies_are_dropped_before_a_request() {
    let served = serve();
    for mut client in [served.pty(), served.tcp()] {
        for stale in 0..3 {
            client.send(&encode_request(1, echo(stale))).unwrap();
        }
        // Wait until the replies have arrived.
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(value(&mut client, echo(99)), 99);
    }
}

#[test]
fn silence_is_an_error_that_says_how_long_it_was_waited() {
    let served = serve();
    let mut client = served.tcp();
    client.set_timeout(Duration::from_millis(30));
    let error = client.request(1, Command::new(REPLY_LATER, 0, 0, 60_000_000)).unwrap_err();
    assert_eq!(error.to_string(), "no reply within 30 ms");
    assert!(error.help().contains("--address"));
}

#[test]
fn what_cannot_be_opened_is_explained() {
    let open = |uri: &str| match uri.parse().unwrap() {
        Uri::Port(port) => Client::open(&port).unwrap_err(),
        Uri::Virtual(_) => unreachable!("not a port"),
    };
    let error = open("/dev/no-such-port");
    assert_eq!(error.to_string(), "there is no port /dev/no-such-port");

    let error = open("/dev/null");
    assert_eq!(error.to_string(), "/dev/null is not a serial port");

    // A port on which nothing listens any more.
    let address = Listener::bind("127.0.0.1").unwrap().address();
    let error = open(&format!("tcp:{address}"));
    assert_eq!(error.to_string(), format!("nothing listens on {address}"));
    assert!(error.help().contains("tmcl serve"));
}

mod desk;
mod faults;
mod text;
