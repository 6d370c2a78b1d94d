//! Whatever is typed: nothing fails, every line for the module is answered once, and a screen shows the line.

use opentmcl_wire::ascii::{
    ECHO_MAX, Echo, LINE_MAX, LineEditor, REPLY_MAX, encode_reply, parse_line,
};
use opentmcl_wire::{Reply, Status};

/// A small generator of numbers, the same ones in every run (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.next() as usize % from.len()]
    }

    /// A few keys: pieces of lines often, any byte sometimes.
    fn keys(&mut self) -> Vec<u8> {
        const BEGINNINGS: &str = "A|\rA|\nA |\ra MST 3\r|\rABIN|a|B|z";
        const REST: &str = "MST 1|MVP ABS, 0, 5|GAP 1, |bin|RUN|STOP|//|0|-9| |,";
        const KEYS: &str = "\r|\n|\r\n|\x08|\x7F|\x08\x08\x08\x08\x08";
        let (any, blanks) = ([self.next() as u8], [b' '; 60]);
        let pieces = [BEGINNINGS, REST, KEYS].into_iter().flat_map(|pieces| pieces.split('|'));
        let pieces = pieces.map(str::as_bytes).chain([&any[..], &any, &blanks]);
        self.pick(&pieces.collect::<Vec<_>>()).to_vec()
    }
}

/// A line as it stands after the keys so far, by the rules alone.
#[derive(Default)]
struct Line {
    characters: Vec<u8>,
}

impl Line {
    /// Yields the line that a key ends.
    fn press(&mut self, key: u8) -> Option<Vec<u8>> {
        match key {
            10 | 13 => return Some(std::mem::take(&mut self.characters)),
            8 | 127 => drop(self.characters.pop()),
            32 if self.characters.is_empty() => {}
            32..=255 => self.characters.push(key),
            _ => {}
        }
        None
    }
}

/// A terminal of one line.
#[derive(Default)]
struct Screen {
    characters: Vec<u8>,
    cursor: usize,
}

impl Screen {
    fn show(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                8 => self.cursor = self.cursor.checked_sub(1).expect("backspace over the edge"),
                13 => *self = Self::default(),
                _ => {
                    self.characters.resize(self.characters.len().max(self.cursor + 1), 0);
                    self.characters[self.cursor] = byte;
                    self.cursor += 1;
                }
            }
        }
    }

    /// What stands before the cursor; behind it there are blanks at most.
    fn text(&self) -> &[u8] {
        let (text, rest) = self.characters.split_at(self.cursor);
        assert!(rest.iter().all(|&byte| byte == b' '));
        text
    }
}

#[test]
fn every_line_for_the_module_is_answered_once_and_others_never_and_the_screen_shows_the_line() {
    let mut random = Random(0x0123_4567_89AB_CDEF);
    let mut editors =
        [Echo::Characters, Echo::Line, Echo::Off].map(|echo| (echo, LineEditor::new()));
    let (mut line, mut screen) = (Line::default(), Screen::default());
    let (mut understood, mut refused, mut too_long, mut passed_over) = (0, 0, 0, 0);
    let keys = (0..100_000).flat_map(|_| random.keys()).collect::<Vec<_>>();
    for key in keys {
        let ended = line.press(key);
        let is_mine = |line: &[u8]| matches!(line, [b'A' | b'a', ..]);
        for (echo, editor) in &mut editors {
            let typed = editor.push(key, 1, *echo);
            assert!(typed.echo.len() <= ECHO_MAX);
            let mine = ended.as_ref().filter(|line| is_mine(line));
            assert_eq!(typed.request, mine.map(|line| parse_line(line, 1).unwrap()));
            match echo {
                Echo::Characters => screen.show(typed.echo),
                Echo::Line => {
                    let shown = mine.map(|line| {
                        let kept = &line[..line.len().min(LINE_MAX + 1)];
                        [kept, b"\r"].concat()
                    });
                    assert_eq!(typed.echo, shown.unwrap_or_default());
                }
                Echo::Off => assert_eq!(typed.echo, b""),
            }
        }
        let expected = if is_mine(&line.characters) { &line.characters[..] } else { b"" };
        assert_eq!(screen.text(), expected);
        match ended {
            Some(line) if is_mine(&line) && line.len() > LINE_MAX => too_long += 1,
            Some(line) if is_mine(&line) => match parse_line(&line, 1) {
                Some(Ok(_)) => understood += 1,
                _ => refused += 1,
            },
            Some(_) => passed_over += 1,
            None => {}
        }
    }
    let counts = [understood, refused, too_long, passed_over];
    assert!(counts.iter().all(|&count| count > 100), "lines of all kinds: {counts:?}");
}

#[test]
fn every_reply_reads_as_its_letters_and_numbers() {
    let mut random = Random(99);
    for _ in 0..10_000 {
        let [host, module, status] = [0; 3].map(|_| random.next() as u8);
        let value = random.next() as i32 >> (random.next() % 32);
        let text = encode_reply(host, module, Reply { status: Status(status), number: 6, value });
        let text = std::str::from_utf8(text.as_bytes()).unwrap();
        assert!(text.len() <= REPLY_MAX);
        let parts = text.strip_suffix('\r').unwrap().split(' ').collect::<Vec<_>>();
        let [letters, status_text, value_text] = parts[..] else { panic!("{text:?}") };
        assert_eq!(letters.len(), 2);
        assert_eq!(status_text, status.to_string());
        assert_eq!(value_text, value.to_string());
    }
}
