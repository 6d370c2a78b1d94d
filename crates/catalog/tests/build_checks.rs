//! The checks of the build: each is shown a small file with one thing wrong, and must say so in a
//! sentence that names the file, the row and what would be right.

#[path = "../build/checks.rs"]
mod checks;
#[path = "../build/data.rs"]
mod data;
#[path = "../build/generate.rs"]
mod generate;
#[path = "build_checks/origin.rs"]
mod origin;

use data::Source;

const FILE: &str = "modules/tmcm-1.toml";

const GOOD: &str = r#"
[module]
name = "tmcm-1"
title = "TMCM-1"
description = "A module for tests."
number = 1
firmware = [1, 2]
version = "0001V102"
axes = 2
motion = "tmc5160"
peak_current_ma = 1500

[[rating]]
name = "Supply voltage"
value = "24 V"

[[axis_parameter]]
number = 4
id = "max_speed"
name = "Maximum speed"
unit = "pps"
min = 0
max = 1000
internal_max = 2000
default = 100
default_source = "manual"
access = "RW"
axes = [1]
behaviour = "axis.max_speed"
description = "Highest speed."

[[axis_parameter]]
number = 2
id = "mode"
name = "Mode"
min = -1
max = 1
default = 0
default_source = "chosen"
access = "R"
stored = "there is only one mode"
description = "Mode of the axis."
values = { 1 = "quick", -1 = "slow" }

[[global_parameter]]
bank = 0
number = 66
id = "address"
name = "Address"
min = 1
max = 255
default = 1
default_source = "open-firmware"
access = "RWA"
behaviour = "globals.address"
description = "Address of the module."

[[global_parameter]]
bank = 2
number = 0
last = 9
id = "variable"
name = "Variable"
min = -2147483648
max = 2147483647
default = 0
default_source = "chosen"
access = "RWE"
behaviour = "variables.variable"
description = "A variable that can be stored."

[[global_parameter]]
bank = 2
number = 10
last = 255
id = "variable"
name = "Variable"
min = -2147483648
max = 2147483647
default = 0
default_source = "chosen"
access = "RW"
behaviour = "variables.variable"
description = "A variable that cannot."

[[interrupt]]
number = 0
id = "timer_0"
name = "Timer 0"
behaviour = "interrupts.timer"
index = 0
description = "A period has passed."

[[interrupt]]
number = 1
id = "timer_1"
name = "Timer 1"
behaviour = "interrupts.timer"
index = 1
description = "Another period has passed."

[[port]]
bank = 0
number = 0
id = "in0"
name = "IN0"
min = 0
max = 1
default = 0
access = "R"
behaviour = "io.input"
index = 0
description = "An input."

[[port]]
bank = 0
number = 0
id = "pull_ups"
name = "Pull-ups"
unit = "°C"
min = 0
max = 3
default = 3
access = "W"
behaviour = "io.pull_ups"
index = 0
description = "A setting under the same number."

[[command]]
number = 1
mnemonic = "ROR"
mode = "both"
since = [1, 1]
description = "Turn."

[[command]]
number = 128
mnemonic = "stop application"
mode = "direct"
unavailable = "it never runs"
description = "Stop."
"#;

fn faults(text: &str) -> Vec<String> {
    let source = Source { file: FILE.to_owned(), text: text.to_owned() };
    match data::parse(&source) {
        Ok(module) => checks::check(&source.file, &module),
        Err(fault) => vec![fault],
    }
}

/// Replaces the only place with that text by another, and expects exactly that one complaint.
#[track_caller]
fn expect(from: &str, to: &str, complaint: &str) {
    assert_eq!(GOOD.matches(from).count(), 1, "{from:?} must be in the good file once");
    assert_eq!(faults(&GOOD.replace(from, to)), [format!("{FILE}: {complaint}")]);
}

/// Adds a row to the good file, and expects exactly that one complaint.
#[track_caller]
fn expect_with(row: &str, complaint: &str) {
    assert_eq!(faults(&format!("{GOOD}\n{row}")), [format!("{FILE}: {complaint}")]);
}

#[test]
fn a_good_file_has_no_faults() {
    assert_eq!(faults(GOOD), [""; 0]);
}

#[test]
fn the_head_fits_the_file_and_the_protocol() {
    expect(
        "name = \"tmcm-1\"",
        "name = \"tmcm-2\"",
        "[module]: name \"tmcm-2\" must be the file's name without .toml",
    );
    expect(
        "0001V102",
        "1V102",
        "[module]: version \"1V102\" must be the 8 ASCII characters that command 136 replies, such \
         as \"6214V116\"",
    );
    expect("axes = 2", "axes = 9", "[module]: axes 9 must be 1 to 8");
    expect(
        "peak_current_ma = 1500",
        "peak_current_ma = 0",
        "[module]: peak_current_ma must be the amplitude that a driver gives, not 0",
    );
    expect(
        "value = \"24 V\"",
        "value = \"\"",
        "[[rating]] Supply voltage: value \"\" must be a text without blanks at its ends",
    );
}

#[test]
fn a_name_that_is_no_name_is_told_even_if_the_file_has_the_same() {
    let source = Source {
        file: "modules/TMCM 1.toml".to_owned(),
        text: GOOD.replace("\"tmcm-1\"", "\"TMCM 1\""),
    };
    let module = data::parse(&source).unwrap();
    assert_eq!(
        checks::check(&source.file, &module),
        [
            "modules/TMCM 1.toml: [module]: name \"TMCM 1\" must be lower case letters and digits with \
          dashes, such as \"tmcm-6214\""
        ]
    );
}

#[test]
fn unknown_missing_and_mistyped_fields_are_told_with_their_line() {
    let line = |text: &str| GOOD[..GOOD.find(text).unwrap()].split('\n').count();

    let at = line("access = \"RWA\"");
    let told = faults(&GOOD.replace("access = \"RWA\"", "acces = \"RWA\""));
    assert_eq!(told.len(), 1);
    assert!(told[0].starts_with(&format!("{FILE}: line {at}: unknown field `acces`")), "{told:?}");

    let at = line("[[command]]\nnumber = 1\n");
    let told = faults(&GOOD.replace("mnemonic = \"ROR\"\n", ""));
    assert_eq!(told, [format!("{FILE}: line {at}: missing field `mnemonic`")]);

    let at = line("mode = \"direct\"");
    let told = faults(&GOOD.replace("mode = \"direct\"", "mode = \"remote\""));
    assert_eq!(
        told,
        [format!(
            "{FILE}: line {at}: unknown variant `remote`, expected one of `both`, `direct`, \
             `standalone`"
        )]
    );
}

#[test]
fn numbers_are_bytes() {
    expect(
        "number = 4\n",
        "number = 256\n",
        "[[axis_parameter]] 256 (max_speed): number 256 must be 0 to 255",
    );
    expect(
        "number = 66\n",
        "number = -1\n",
        "[[global_parameter]] 0/-1 (address): number -1 must be 0 to 255",
    );
    expect(
        "last = 255\n",
        "last = 256\n",
        "[[global_parameter]] 2/10 (variable): last 256 must be 0 to 255",
    );
    expect(
        "last = 255\n",
        "last = 9\n",
        "[[global_parameter]] 2/10 (variable): last 9 must not be below number 10",
    );
    expect(
        "number = 1\nid = \"timer_1\"",
        "number = 1000\nid = \"timer_1\"",
        "[[interrupt]] 1000 (timer_1): number 1000 must be 0 to 255",
    );
    expect(
        "bank = 0\nnumber = 0\nid = \"in0\"",
        "bank = 300\nnumber = 0\nid = \"in0\"",
        "[[port]] 300/0 (in0): bank 300 must be 0 to 255",
    );
    expect(
        "number = 128\n",
        "number = 500\n",
        "[[command]] 500 (stop application): number 500 must be 0 to 255",
    );
}

#[test]
fn numbers_and_names_are_used_once() {
    expect(
        "number = 2\nid = \"mode\"",
        "number = 4\nid = \"mode\"",
        "[[axis_parameter]] 4 (mode): number must differ from that of row 4 (max_speed)",
    );
    expect(
        "id = \"mode\"",
        "id = \"max_speed\"",
        "[[axis_parameter]] 2 (max_speed): id must differ from that of row 4 (max_speed)",
    );
    expect(
        "id = \"timer_1\"",
        "id = \"timer_0\"",
        "[[interrupt]] 1 (timer_0): id must differ from that of row 0 (timer_0)",
    );
    expect(
        "number = 1\nid = \"timer_1\"",
        "number = 0\nid = \"timer_1\"",
        "[[interrupt]] 0 (timer_1): number must differ from that of row 0 (timer_0)",
    );
    expect_with(
        "[[command]]\nnumber = 128\nmnemonic = \"halt\"\nmode = \"direct\"\ndescription = \"Halt.\"",
        "[[command]] 128 (halt): number must differ from that of row 128 (stop application)",
    );
    expect_with(
        "[[command]]\nnumber = 129\nmnemonic = \"stop application\"\nmode = \"direct\"\n\
         description = \"Halt.\"",
        "[[command]] 129 (stop application): mnemonic must differ from that of row 128 (stop \
         application)",
    );
}

#[test]
fn rows_of_equal_global_parameters_share_a_name_only_where_one_goes_on_with_the_other() {
    let row = |bank: u8, number: u8, id: &str| {
        format!(
            "[[global_parameter]]\nbank = {bank}\nnumber = {number}\nid = \"{id}\"\nname = \"X\"\n\
             min = 0\nmax = 1\ndefault = 0\ndefault_source = \"chosen\"\naccess = \"RW\"\n\
             behaviour = \"globals.x\"\ndescription = \"X.\""
        )
    };
    expect_with(
        &row(3, 0, "variable"),
        "[[global_parameter]] 3/0 (variable): id must differ from that of row 2/0 (variable)",
    );
    expect_with(
        &row(2, 200, "x"),
        "[[global_parameter]] 2/200 (x): bank and number must differ from that of row 2/10 \
         (variable)",
    );
    assert_eq!(faults(&format!("{GOOD}\n{}", row(3, 200, "x"))), [""; 0]);
}

#[test]
fn a_port_number_has_at_most_one_row_for_gio_and_one_for_sio() {
    expect(
        "access = \"W\"",
        "access = \"R\"",
        "[[port]] 0/0 (pull_ups): bank, number and access letter must differ from that of row 0/0 \
         (in0)",
    );
    expect(
        "id = \"pull_ups\"",
        "id = \"in0\"",
        "[[port]] 0/0 (in0): bank and id must differ from that of row 0/0 (in0)",
    );
}

#[test]
fn a_range_holds_the_default_and_fits_a_value() {
    expect(
        "default = 100\n",
        "default = 1001\n",
        "[[axis_parameter]] 4 (max_speed): default 1001 must lie in the range 0..1000",
    );
    expect(
        "min = 1\nmax = 255\n",
        "min = 256\nmax = 255\n",
        "[[global_parameter]] 0/66 (address): min 256 must not be above max 255",
    );
    expect(
        "max = 1000\n",
        "max = 2147483648\n",
        "[[axis_parameter]] 4 (max_speed): range 0..2147483648 with default 100 must fit the 32 \
         bits of a value",
    );
    expect(
        "max = 255\ndefault = 1\n",
        "max = 4294967296\ndefault = 1\n",
        "[[global_parameter]] 0/66 (address): range 1..4294967296 with default 1 must fit the 32 \
         bits of a value",
    );
    expect(
        "max = 3\ndefault = 3\n",
        "max = 3\ndefault = 4\n",
        "[[port]] 0/0 (pull_ups): default 4 must lie in the range 0..3",
    );
}

#[test]
fn a_range_of_32_bits_without_sign_is_legal_for_global_parameters() {
    assert_eq!(faults(&GOOD.replace("max = 255\n", "max = 4294967295\n")), [""; 0]);
}

#[test]
fn speeds_and_only_speeds_have_a_largest_register_value() {
    expect(
        "internal_max = 2000\n",
        "",
        "[[axis_parameter]] 4 (max_speed): internal_max is missing; a row in pps or pps2 needs the \
         largest value of its register",
    );
    expect(
        "unit = \"pps\"\n",
        "unit = \"ms\"\n",
        "[[axis_parameter]] 4 (max_speed): internal_max must be left out; only rows in pps and pps2 \
         are converted",
    );
    expect(
        "internal_max = 2000\n",
        "internal_max = 0\n",
        "[[axis_parameter]] 4 (max_speed): internal_max 0 must be 1 to 2147483647",
    );
}

#[test]
fn access_letters_are_legal_and_in_order() {
    let told = |access: &str, legal: &str, row: &str| {
        format!("{row}: access {access:?} must be one or more of {legal}, in this order")
    };
    let axis = "[[axis_parameter]] 2 (mode)";
    let old = "access = \"R\"\nstored";
    for wrong in ["", "X", "WR", "RR", "RWA", "rw"] {
        expect(old, &format!("access = \"{wrong}\"\nstored"), &told(wrong, "R, W, E", axis));
    }
    expect(
        old,
        "access = \"RE\"\nstored",
        &format!("{axis}: access \"RE\" has E (stored on request) but no W; it must be writable"),
    );
    let global = "[[global_parameter]] 0/66 (address)";
    for wrong in ["RAW", "RWAE", "RWP"] {
        let new = format!("access = \"{wrong}\"");
        expect("access = \"RWA\"", &new, &told(wrong, "R, W, E, A", global));
    }
    expect(
        "access = \"RWA\"",
        "access = \"RA\"",
        "[[global_parameter]] 0/66 (address): access \"RA\" has A (stored by each write) but no W; \
         it must be writable",
    );
    let port = "[[port]] 0/0 (pull_ups)";
    expect("access = \"W\"", "access = \"WA\"", &told("WA", "R, W", port));
}

#[test]
fn axes_exist() {
    expect(
        "axes = [1]",
        "axes = [1, 2]",
        "[[axis_parameter]] 4 (max_speed): axis 2 must be 0 to 1",
    );
    expect(
        "axes = [1]",
        "axes = []",
        "[[axis_parameter]] 4 (max_speed): axes must name at least one axis; leave it out for all",
    );
    expect(
        "axes = [1]",
        "axes = [1, 0, 1]",
        "[[axis_parameter]] 4 (max_speed): axis 1 must be named once",
    );
}

#[test]
fn a_row_has_an_effect_in_a_known_room_or_says_why_it_has_none() {
    let both = "must have either behaviour = \"room.effect\" or stored = \"why nothing follows\"";
    expect(
        "stored = \"there is only one mode\"",
        "",
        &format!("[[axis_parameter]] 2 (mode): {both}"),
    );
    expect(
        "stored = \"there is only one mode\"",
        "stored = \"there is only one mode\"\nbehaviour = \"axis.mode\"",
        &format!("[[axis_parameter]] 2 (mode): {both}"),
    );
    expect(
        "stored = \"there is only one mode\"",
        "stored = \"\"",
        "[[axis_parameter]] 2 (mode): stored \"\" must be a text without blanks at its ends",
    );
    expect(
        "behaviour = \"globals.address\"",
        "behaviour = \"axis.address\"",
        "[[global_parameter]] 0/66 (address): behaviour \"axis.address\" must name one of the rooms \
         of this table: globals, variables, interrupts",
    );
    expect(
        "behaviour = \"io.input\"",
        "behaviour = \"io\"",
        "[[port]] 0/0 (in0): behaviour \"io\" must name an effect in snake_case after the dot",
    );
}

#[test]
fn texts_and_ids_are_clean() {
    expect(
        "\"Highest speed.\"",
        "\"Highest speed. \"",
        "[[axis_parameter]] 4 (max_speed): description \"Highest speed. \" must be a text without \
         blanks at its ends",
    );
    expect(
        "id = \"address\"",
        "id = \"Address\"",
        "[[global_parameter]] 0/66 (Address): id \"Address\" must be snake_case, such as \
         \"target_position\"",
    );
    for wrong in ["", "2nd", "a__b", "a_", "a-b"] {
        assert!(!data::is_snake_case(wrong), "{wrong:?}");
    }
}

#[test]
fn values_lie_in_the_range_and_have_a_meaning() {
    expect(
        "1 = \"quick\"",
        "2 = \"quick\"",
        "[[axis_parameter]] 2 (mode): values names 2, which must be a number in the range -1..1",
    );
    expect(
        "1 = \"quick\"",
        "one = \"quick\"",
        "[[axis_parameter]] 2 (mode): values names one, which must be a number in the range -1..1",
    );
    expect(
        "1 = \"quick\"",
        "1 = \"\"",
        "[[axis_parameter]] 2 (mode): meaning of a value \"\" must be a text without blanks at its \
         ends",
    );
}

#[test]
fn commands_agree_with_the_language() {
    expect(
        "mnemonic = \"ROR\"",
        "mnemonic = \"ROL\"",
        "[[command]] 1 (ROL): mnemonic \"ROL\" must be \"ROR\", which is command 1 of the language",
    );
    expect(
        "number = 1\nmnemonic = \"ROR\"",
        "number = 200\nmnemonic = \"ROR\"",
        "[[command]] 200 (ROR): number 200 must be 1, the number of ROR",
    );
    expect(
        "\"stop application\"",
        "\"HALT\"",
        "[[command]] 128 (HALT): mnemonic \"HALT\" must be a name in lower case, as the language has \
         no mnemonic for this number",
    );
}

#[test]
fn the_generated_code_has_the_rows_in_order_and_one_variant_for_each_effect() {
    let source = Source { file: FILE.to_owned(), text: GOOD.to_owned() };
    let code = generate::generate(&[data::parse(&source).unwrap()]).unwrap();
    for part in [
        "pub enum Axis {\n    /// TMCM-1 axis parameter 4 (Maximum speed).\n    MaxSpeed,\n}",
        "pub enum Variables {\n    /// TMCM-1 global parameter 2/0 (Variable) and 1 more.\n    \
         Variable,\n}",
        "pub enum InterruptBehaviour {\n    /// TMCM-1 interrupt 0 (Timer 0) and 1 more.\n    \
         Timer,\n}",
        "Tmc5160(Tmc5160),",
        "Stored(&'static str),",
        "pub static TMCM_1: Module = Module {",
        "version: *b\"0001V102\"",
        "peak_current_ma: 1500",
        "behaviour: AxisBehaviour::Axis(Axis::MaxSpeed)",
        "behaviour: AxisBehaviour::Stored(\"there is only one mode\")",
        "values: &[(-1, \"slow\"), (1, \"quick\")]",
        "behaviour: PortBehaviour::PullUps",
        "unit: Unit::Other(\"°C\")",
        "mode: Mode::Both, unavailable: None, since: Some((1, 1))",
        "motion: Motion::Tmc5160,",
        "pub enum AxisBehaviour {",
        "Tmc429(Tmc429),\n",
        "Tmc26x(Tmc26x),\n",
        "Servo(Servo),\n",
        "Foc(Foc),\n",
        "Block(Block),\n",
        "unavailable: Some(\"it never runs\")",
        "pub static MODULES: &[&Module] = &[&TMCM_1];",
    ] {
        assert!(code.contains(part), "{part}\nis missing in\n{code}");
    }
    // Parameter 2 comes first and belongs to both axes; parameter 4 belongs to axis 1 only.
    assert!(code.find("number: 2, id: \"mode\"") < code.find("number: 4, id: \"max_speed\""));
    assert!(code.contains("axes: 3, behaviour: AxisBehaviour::Stored"));
    assert!(code.contains("axes: 2, behaviour: AxisBehaviour::Axis"));
    assert!(code.contains("axis_parameter_index: &[255, 255, 0, 255, 1, 255,"));
}
