//! What a line does to one frame after the other.

use std::time::Duration;

use opentmcl_wire::Instant;
use opentmcl_wire::ascii::REPLY_MAX;
use opentmcl_wire::serial::{BYTE_TIMEOUT, FRAME_LEN};

use super::counts::Counts;
use super::random::{random, unit};
use super::spec::{Fault, Rates};

type Frame = [u8; FRAME_LEN];

/// The most bytes that noise puts in front of a frame.
const MAX_STRAY: usize = 4;

/// A reply from before, noise, the frame, and the frame once more.
const MAX_PIECE: usize = FRAME_LEN + MAX_STRAY + 2 * FRAME_LEN;

/// Random numbers set aside for each frame: one for each fault, the others for how it looks.
const DRAWS: u64 = 16;

/// The numbers that say how a fault looks, behind those that say whether there is one.
#[derive(Clone, Copy)]
enum Draw {
    DamagedByte = Fault::ALL.len() as isize,
    FlippedBits,
    KeptBytes,
    StrayCount,
    StrayBytes,
}

/// One direction of a port: the frames that go in come out as the line delivers them.
#[derive(Clone, Debug)]
pub(crate) struct Injector {
    rates: Rates,
    seed: u64,
    counts: Counts,
}

/// What comes out of the line at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    bytes: [u8; MAX_PIECE],
    len: usize,
    /// How much later than it would come without faults.
    pub(crate) delay: Duration,
}

impl Injector {
    /// A line that has not carried a frame yet.
    pub(crate) fn new(rates: Rates, seed: u64) -> Self {
        Self { rates, seed, counts: Counts::default() }
    }

    /// Whether every frame passes unharmed.
    pub(crate) fn is_idle(&self) -> bool {
        self.rates.is_none()
    }

    pub(crate) fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Counts a frame on a line that harms none.
    pub(crate) fn pass(&mut self) {
        self.counts.frames += 1;
    }

    /// Counts a frame that did not get through for lack of room.
    pub(crate) fn overflow(&mut self) {
        self.counts.note(Fault::Drop);
    }

    /// Sends a frame. `withheld` belongs to the connection: what it has not been given yet.
    pub(crate) fn send(&mut self, mut frame: Frame, withheld: &mut Option<Frame>) -> Piece {
        let number = self.counts.frames;
        self.counts.frames += 1;
        let mut piece = Piece::empty();
        if self.happens(number, Fault::Drop) {
            return piece;
        }
        if let Some(earlier) = withheld.take() {
            piece.push(&earlier);
        }
        if self.happens(number, Fault::Stale) {
            *withheld = Some(frame);
        } else {
            if self.happens(number, Fault::Corrupt) {
                let byte = self.draw(number, Draw::DamagedByte) % FRAME_LEN as u64;
                let bits = self.draw(number, Draw::FlippedBits) % 255 + 1;
                frame[byte as usize] ^= bits as u8;
            }
            let kept = if self.happens(number, Fault::Truncate) {
                self.draw(number, Draw::KeptBytes) as usize % (FRAME_LEN - 1) + 1
            } else {
                FRAME_LEN
            };
            if self.happens(number, Fault::Stray) {
                let count = self.draw(number, Draw::StrayCount) as usize % MAX_STRAY + 1;
                piece.push(&self.draw(number, Draw::StrayBytes).to_le_bytes()[..count]);
            }
            piece.push(&frame[..kept]);
            if self.happens(number, Fault::Duplicate) {
                piece.push(&frame[..kept]);
            }
        }
        if piece.len > 0 && self.happens(number, Fault::Delay) {
            piece.delay = self.rates.delay();
        }
        piece
    }

    /// Whether this frame meets the fault; if so, it is counted.
    fn happens(&mut self, number: u64, fault: Fault) -> bool {
        let drawn = unit(self.number(number, fault as u64));
        let happens = drawn < self.rates.rate(fault);
        if happens {
            self.counts.note(fault);
        }
        happens
    }

    fn draw(&self, number: u64, draw: Draw) -> u64 {
        self.number(number, draw as u64)
    }

    fn number(&self, number: u64, place: u64) -> u64 {
        random(self.seed, number.wrapping_mul(DRAWS).wrapping_add(place))
    }
}

impl Piece {
    const fn empty() -> Self {
        Self { bytes: [0; MAX_PIECE], len: 0, delay: Duration::ZERO }
    }

    /// A few bytes that no fault meets, at most a reply in text.
    pub(crate) fn unharmed(bytes: &[u8]) -> Self {
        const { assert!(REPLY_MAX <= MAX_PIECE) };
        let mut piece = Self::empty();
        piece.push(bytes);
        piece
    }

    fn push(&mut self, bytes: &[u8]) {
        self.bytes[self.len..self.len + bytes.len()].copy_from_slice(bytes);
        self.len += bytes.len();
    }

    /// The bytes; none if the frame was lost.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

/// Cuts what a client sends into frames, good or damaged, as the receiver behind the line will.
///
/// It forgets half a frame after the same silence as the receiver, for which the bytes would have
/// been lost in any case.
#[derive(Clone, Debug, Default)]
pub(crate) struct Framer {
    frame: Frame,
    len: usize,
    last_byte_at: Option<Instant>,
}

impl Framer {
    /// Takes the byte that arrived at `now`; yields a frame when it completes one.
    pub(crate) fn push(&mut self, byte: u8, now: Instant) -> Option<Frame> {
        let silence = self.last_byte_at.and_then(|last| now.checked_duration_since(last));
        if silence.is_some_and(|silence| silence > BYTE_TIMEOUT) {
            self.len = 0;
        }
        self.last_byte_at = Some(now);
        self.frame[self.len] = byte;
        self.len = (self.len + 1) % FRAME_LEN;
        (self.len == 0).then_some(self.frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::Faults;

    const FRAMES: u64 = 100_000;

    /// A frame that tells its number.
    fn numbered(number: u64) -> Frame {
        let mut frame = [0xA5; FRAME_LEN];
        frame[1..].copy_from_slice(&number.to_be_bytes());
        frame
    }

    fn injector(spec: &str) -> Injector {
        spec.parse::<Faults>().unwrap().reply_injector()
    }

    /// What comes out for the first frames.
    fn sent(spec: &str, count: u64) -> (Vec<Piece>, Counts) {
        let mut injector = injector(spec);
        let mut withheld = None;
        let pieces = (0..count).map(|at| injector.send(numbered(at), &mut withheld)).collect();
        (pieces, *injector.counts())
    }

    fn bytes(spec: &str, count: u64) -> Vec<Vec<u8>> {
        sent(spec, count).0.iter().map(|piece| piece.bytes().to_vec()).collect()
    }

    /// By how many bits two frames differ, and in how many bytes.
    fn difference(one: &[u8], other: &[u8]) -> (u32, usize) {
        let differing = one.iter().zip(other).map(|(one, other)| (one ^ other).count_ones());
        (differing.clone().sum(), differing.filter(|&bits| bits > 0).count())
    }

    #[test]
    fn without_faults_frames_pass_unchanged_and_at_once() {
        let (pieces, counts) = sent("none", 1000);
        for (number, piece) in pieces.iter().enumerate() {
            assert_eq!(piece.bytes(), numbered(number as u64));
            assert_eq!(piece.delay, Duration::ZERO);
        }
        assert_eq!(counts.frames, 1000);
        assert!(Fault::ALL.iter().all(|&fault| counts[fault] == 0));
    }

    #[test]
    fn each_fault_is_met_as_often_as_its_rate_says() {
        // Of 100 000 frames at a rate p, the mean is 100 000 p and the standard deviation
        // sqrt(100 000 p (1 - p)): for 0.01 they are 1000 and 31.5, for 0.5 they are 50 000 and 158.
        // Five standard deviations are missed by chance once in 1.7 million times.
        for fault in Fault::ALL {
            for (rate, low, high) in [("0.01", 843, 1157), ("0.5", 49_209, 50_791)] {
                for seed in 0..5 {
                    let by = if fault == Fault::Delay { "20ms@" } else { "" };
                    let spec = format!("{}={by}{rate},seed={seed}", fault.name());
                    let met = sent(&spec, FRAMES).1[fault];
                    assert!((low..=high).contains(&met), "{spec}: {met}");
                }
            }
        }
    }

    #[test]
    fn a_dropped_frame_is_gone() {
        assert!(bytes("drop=1", 100).iter().all(Vec::is_empty));
        let (pieces, counts) = sent("drop=0.5", 1000);
        let gone = pieces.iter().filter(|piece| piece.bytes().is_empty()).count();
        assert_eq!(gone as u64, counts[Fault::Drop]);
    }

    #[test]
    fn a_corrupted_frame_differs_in_one_byte() {
        let mut places = [false; FRAME_LEN];
        for (number, bytes) in bytes("corrupt=1", 1000).iter().enumerate() {
            let original = numbered(number as u64);
            assert_eq!(bytes.len(), FRAME_LEN);
            assert_eq!(difference(bytes, &original).1, 1);
            let place = bytes.iter().zip(original).position(|(&one, other)| one != other);
            places[place.unwrap()] = true;
        }
        // That one of nine is never hit in 1000 times has the probability 9 (8/9)^1000 < 10^-50.
        assert_eq!(places, [true; FRAME_LEN]);
    }

    #[test]
    fn a_truncated_frame_is_its_beginning() {
        let mut lengths = [false; FRAME_LEN + 1];
        for (number, bytes) in bytes("truncate=1", 1000).iter().enumerate() {
            assert_eq!(*bytes, numbered(number as u64)[..bytes.len()]);
            lengths[bytes.len()] = true;
        }
        let one_to_eight = std::array::from_fn(|len| (1..FRAME_LEN).contains(&len));
        assert_eq!(lengths, one_to_eight);
    }

    #[test]
    fn a_duplicated_frame_comes_twice() {
        for (number, bytes) in bytes("duplicate=1", 100).iter().enumerate() {
            assert_eq!(*bytes, [numbered(number as u64); 2].concat());
        }
    }

    #[test]
    fn stray_bytes_come_before_the_frame() {
        let mut counts = [false; MAX_STRAY + 1];
        for (number, bytes) in bytes("stray=1", 1000).iter().enumerate() {
            let stray = bytes.len() - FRAME_LEN;
            assert_eq!(bytes[stray..], numbered(number as u64));
            counts[stray] = true;
        }
        assert_eq!(counts, [false, true, true, true, true]);
    }

    #[test]
    fn delayed_frames_say_by_how_much() {
        let (pieces, _) = sent("delay=20ms", 100);
        assert!(pieces.iter().all(|piece| piece.delay == Duration::from_millis(20)));
    }

    #[test]
    fn always_stale_replies_are_off_by_one() {
        let replies = bytes("stale=1", 100);
        assert!(replies[0].is_empty());
        for (number, bytes) in (0..).zip(&replies[1..]) {
            assert_eq!(*bytes, numbered(number));
        }
    }

    #[test]
    fn a_stale_reply_comes_with_the_next_one() {
        let replies = bytes("stale=0.5,seed=3", 1000);
        // None is lost and the order is kept, apart from one that may still be withheld.
        let came = replies.concat();
        let all: Vec<u8> = (0..came.len() / FRAME_LEN).flat_map(|at| numbered(at as u64)).collect();
        assert_eq!(came, all);
        assert!(came.len() >= 999 * FRAME_LEN);
        assert!(replies.iter().any(|bytes| bytes.len() == 2 * FRAME_LEN));
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_and_another_one_does_not() {
        let spec = "drop=0.1,corrupt=0.1,truncate=0.1,duplicate=0.1,stray=0.1,stale=0.1";
        let with_seed = |seed: u32| bytes(&format!("{spec},seed={seed}"), 1000);
        assert_eq!(with_seed(7), with_seed(7));
        assert_ne!(with_seed(7), with_seed(8));
    }

    #[test]
    fn the_two_directions_meet_different_faults() {
        let faults: Faults = "drop=0.5,requests.drop=0.5".parse().unwrap();
        let pattern = |mut injector: Injector| -> Vec<bool> {
            let sent = |at| injector.send(numbered(at), &mut None).bytes().is_empty();
            (0..64).map(sent).collect()
        };
        assert_ne!(pattern(faults.reply_injector()), pattern(faults.request_injector()));
    }

    #[test]
    fn one_more_fault_changes_nothing_about_the_others() {
        let corrupted = bytes("corrupt=0.1,seed=5", 1000);
        let both = bytes("corrupt=0.1,drop=0.1,seed=5", 1000);
        for (alone, together) in corrupted.iter().zip(&both) {
            assert!(together.is_empty() || together == alone);
        }
    }

    #[test]
    fn a_framer_forgets_half_a_frame_after_the_silence_of_the_receiver() {
        let at = |micros: u64| Instant::from_ticks(micros * 16);
        let frame = numbered(7);
        for (silence, whole) in [(5_000, false), (5_001, true)] {
            let mut framer = Framer::default();
            assert!(frame[..4].iter().all(|&byte| framer.push(byte, at(0)).is_none()));
            let found = frame.iter().filter_map(|&byte| framer.push(byte, at(silence))).next();
            assert_eq!(found == Some(frame), whole);
        }
    }
}
