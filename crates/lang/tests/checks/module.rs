//! Commands against what the TMCM-6214 has; the numbers are from its firmware manual.

use opentmcl_catalog::Module;

use crate::{said, says, tells, tmcm_6214};

#[track_caller]
fn tells_of_commands(text: &str) {
    tells(text, true, Some(tmcm_6214()));
}

#[test]
fn a_module_with_its_own_units_and_older_firmware_is_checked_by_its_own_tables() {
    // 2047 is the fastest; 150 and global 131 came with later firmware; 160 to 184 cannot be stored.
    tells(
        "ROR 0, 2048      //! value-out-of-range
        ROL 0, 2047
        SAP 150, 0, 1     //! no-such-axis-parameter
        GGP 131, 0        //! no-such-global-parameter
        STAP 4, 0
        RSAP 214, 5
        STAP 160, 0       //! not-storable
        RSAP 4, 6         //! no-such-axis
        SAPX 4, 3         //! no-such-command",
        true,
        opentmcl_catalog::find("tmcm-6110"),
    );
}

#[test]
fn commands_that_a_module_does_not_run() {
    // 3.6.56: user functions; 3.6.57: control commands; STAP and SAC are of older modules.
    tells_of_commands(
        "UF3          //! command-not-available
        STAP 4, 0     //! no-such-command
        SAC 0, 0, 0   //! no-such-command
        200 0, 0, 0   //! no-such-command
        136 1, 0, 0   //! command-not-available
        255 0, 0, 1234 //! command-not-available
        16 4, 0, 1000
        MVPXA ABS
        0 0, 0, 0",
    );
    says(
        "132 0, 0, 0",
        &[
            "132 | the TMCM-6214 refuses 132 | 132 is enter download mode, which only a host may send",
        ],
    );
}

#[test]
fn without_a_module_nothing_is_refused() {
    tells("UF3\nMST 9\nSAP 30, 0, 5\nGIO 77, 7\nEI 255\n16 4, 77, 1000", true, None);
}

#[test]
fn axes_that_do_not_exist() {
    tells_of_commands(
        "Motor = 6
        MST 5
        MST 6           //! no-such-axis
        ROR Motor, 5    //! no-such-axis
        MVPA REL, 255   //! no-such-axis
        RFS STATUS, 6   //! no-such-axis
        CCO 1, 255      //! no-such-axis
        WAIT POS, 6, 0  //! no-such-axis
        WAIT TICKS, 6, 1
        SCO 0, 255, 0
        GCO 5, 255
        ACO 0, 255
        3 0, 6, 0       //! no-such-axis",
    );
    says(
        "Motor = 7\nGAP 1, Motor\nMST $6",
        &[
            "Motor | the TMCM-6214 has no axis 7 (Motor) | its axes are 0..5",
            "$6 | the TMCM-6214 has no axis 6 ($6) | its axes are 0..5",
        ],
    );
}

#[test]
fn a_move_to_coordinates_takes_a_set_of_axes() {
    // 3.6.4: $80 without and $40 with interpolation.
    tells_of_commands(
        "MVP COORD, $85, 5
        MVP COORD, $7F, 20
        MVPA COORD, $47
        MVPA COORD, $BF
        MVP COORD, 6, 0     //! no-such-axis
        MVP COORD, $80, 0   //! no-such-axis
        MVPA COORD, $40     //! no-such-axis
        MVP ABS, $85, 5     //! no-such-axis
        MVPA REL, $47       //! no-such-axis",
    );
    says(
        "MVP COORD, $C0, 1",
        &["$C0 | 192 ($C0) is a set without any axis | add to $80 (each by itself) or $40 \
         (together) 1 for axis 0, 2 for axis 1, 4 for axis 2 and so on"],
    );
}

#[test]
fn a_module_with_fewer_axes_has_smaller_sets() {
    let three: &'static Module = Box::leak(Box::new(Module { axes: 3, ..*tmcm_6214() }));
    tells(
        "MST 2
        MST 3              //! no-such-axis
        MVP COORD, $87, 1
        MVP COORD, $88, 1  //! no-such-axis
        MVPA COORD, $4F    //! no-such-axis",
        true,
        Some(three),
    );
    assert_eq!(
        said("MVP COORD, $C8, 1", Some(three)),
        [
            "$C8 | 200 ($C8) is a set with an axis that the TMCM-6214 does not have | add to $80 (each \
          by itself) or $40 (together) 1 for axis 0, 2 for axis 1, 4 for axis 2 and so on"
        ]
    );
}

#[test]
fn an_operand_too_long_for_a_message_is_not_repeated() {
    let text = format!("MST {}", ["1"; 30].join(" + "));
    let findings = said(&text, Some(tmcm_6214()));
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert!(finding.contains("| the TMCM-6214 has no axis 30 |"), "{finding}");
}

#[test]
fn axis_parameters_that_do_not_exist_or_cannot_be_written() {
    // Table 16: 30 is missing, 3 and 180 can only be read, 209 is for axes with encoders, 3 to 5.
    tells_of_commands(
        "GAP 3, 0
        GAPX 209
        SAP 30, 0, 1       //! no-such-axis-parameter
        GAPX 30            //! no-such-axis-parameter
        AAP 3, 0           //! not-writable
        SAPX 180, 1        //! not-writable
        AAPX 180           //! not-writable
        SAP 209, 3, 0
        GAP 209, 2         //! no-such-axis-parameter
        // One mistake at a time: the axis is not there at all.
        GAP 209, 6         //! no-such-axis",
    );
    says(
        "GAP 210, 0",
        &["210 | axis 0 has no axis parameter 210, Encoder resolution | axes 3..5 have it"],
    );
    says(
        "AAP 8, 0",
        &["8 | axis parameter 8, Position reached flag, can only be read | GAP reads it"],
    );
}

#[test]
fn values_of_axis_parameters_out_of_range() {
    tells_of_commands(
        "Current = 256
        SAP 6, 0, 255
        SAP 6, 0, Current      //! value-out-of-range
        SAP 6, 0, -1           //! value-out-of-range
        SAPX 140, 8
        SAPX 140, 9            //! value-out-of-range
        SAP 4, 0, 7999774
        SAP 4, 0, 7999775      //! value-out-of-range
        SAP 174, 0, -64
        SAP 174, 0, -65        //! value-out-of-range
        // 6.1: modes 1..10, 1..4 plus 64, 5..8 plus 128.
        SAP 193, 0, 68
        SAP 193, 0, 136
        SAP 193, 0, 69         //! value-out-of-range
        SAP 193, 0, 132        //! value-out-of-range
        // Positions from an encoder, which axes 3 to 5 have.
        SAP 127, 3, 2
        SAP 127, 2, 1
        SAPX 127, 2
        SAP 127, 2, 2          //! value-out-of-range",
    );
    says(
        "Current = 300\nSAP 6, 0, Current",
        &[
            "Current | 300 (Current) is out of range for axis parameter 6, Maximum current | it takes \
         0..255",
        ],
    );
    says(
        "SAP 193, 0, 11\nSAP 127, 0, 2\nSAP 4, 0, -5",
        &[
            "11 | 11 is out of range for axis parameter 193, Reference search mode | it takes 1..10, \
             65..68, 133..136",
            "2 | 2 is out of range for axis parameter 127, Relative positioning option | 2 counts \
             from the encoder, which axes 3..5 have",
            "-5 | -5 is out of range for axis parameter 4, Maximum positioning speed | it takes \
             0..7999774 pps",
        ],
    );
}

#[test]
fn with_the_units_of_the_chip_other_ranges_hold_too() {
    // 8388096 is the largest value of the register, 7999774 the same in pps.
    tells_of_commands(
        "SAP 255, 0, 0
        ROR 0, 8388096
        SAP 4, 0, 8388096
        SAP 5, 0, 65535
        SAP 2, 0, -8388096
        ROL 0, 8388097       //! value-out-of-range
        SAP 4, 0, -1         //! value-out-of-range
        SAP 6, 0, 256        //! value-out-of-range",
    );
    tells_of_commands("ROR 0, 8388096 //! value-out-of-range");
    says(
        "AAPX 255\nSAP 4, 0, 9000000",
        &[
            "9000000 | 9000000 is out of range for axis parameter 4, Maximum positioning speed | it \
         takes 0..7999774 pps, and 0..8388096 with unit mode 0",
        ],
    );
}

#[test]
fn speeds_out_of_range() {
    tells_of_commands(
        "ROR 0, 7999774
        ROL 5, -7999774
        ROR 0, 7999775      //! value-out-of-range
        ROL 0, -7999775     //! value-out-of-range
        ROL 0, -2147483648  //! value-out-of-range",
    );
    says(
        "ROL 0, 8000000",
        &[
            "8000000 | 8000000 is out of range for the speed of ROL | it takes -7999774..7999774 pps",
        ],
    );
}

#[test]
fn global_parameters_by_bank() {
    // Chapter 5: bank 0 settings, 2 variables of which 56 can be stored, 3 interrupts.
    tells_of_commands(
        "SGP 66, 0, 3
        SGP 67, 0, 3         //! no-such-global-parameter
        SGP 66, 0, 0         //! value-out-of-range
        GGP 128, 0
        SGP 128, 0, 1        //! not-writable
        AGP 130, 0           //! not-writable
        GGP 0, 1             //! no-such-bank
        SGP 255, 2, -1
        SGP 0, 3, -1
        SGP 39, 3, 3
        SGP 39, 3, 4         //! value-out-of-range
        SGP 3, 3, 1          //! no-such-global-parameter
        STGP 55, 2
        STGP 56, 2           //! not-storable
        RSGP 77, 0
        RSGP 132, 0          //! not-storable",
    );
    says(
        "GGP 5, 4\nGGP 3, 3\nSTGP 60, 2\nSGP 77, 0, 2\nSTGP 0, 3",
        &[
            "4 | the TMCM-6214 has no bank 4 of global parameters | its banks are 0, 2, 3",
            "3 | bank 3 of the TMCM-6214 has no parameter 3 | it has 0..2, 27..46",
            "60 | global parameter 60, User variable 56 to 255, cannot be stored | in bank 2, 0..55 can be \
             stored",
            "2 | 2 is out of range for global parameter 77, Auto start mode | it takes 0..1",
            "0 | global parameter 0, Timer 0 period, cannot be stored | nothing in bank 3 can be \
             stored",
        ],
    );
}

#[test]
fn inputs_and_outputs_by_bank() {
    // 3.6.12 and 3.6.13.
    tells_of_commands(
        "GIO 14, 0
        GIO 8, 0          //! no-such-port
        GIO 1, 1          //! no-such-port
        GIO 255, 2
        GIO 0, 3          //! no-such-bank
        SIO 0, 0, 3       // pull-up resistors
        SIO 0, 0, 4       //! value-out-of-range
        SIO 1, 0, 1       //! no-such-port
        SIO 7, 2, 1
        SIO 7, 2, 2       //! value-out-of-range
        SIO 255, 2, -1
        SIO 255, 2, 256   //! value-out-of-range
        SIO 0, 255, 0     //! no-such-bank",
    );
    says(
        "SIO 5, 0, 1\nGIO 2, 1\nSIO 3, 2, 7\nSIO 1, 7, 0",
        &[
            "5 | bank 0 of the TMCM-6214 has no output 5 | it has 0",
            "2 | bank 1 of the TMCM-6214 has no input 2 | it has 0, 4, 8..10",
            "7 | 7 is out of range for OUT3 | it takes 0..1",
            "7 | the TMCM-6214 has no bank 7 of outputs | banks 0..2 have some",
        ],
    );
}

#[test]
fn interrupts_that_do_not_exist() {
    // Table 12.
    tells_of_commands(
        "VECT 46, Handler
        VECT 9, Handler       //! no-such-interrupt, interrupt-not-enabled
        VECT 255, Handler     //! no-such-interrupt
        EI 46
        EI 47                 //! no-such-interrupt, interrupt-without-vector
        EI 255
        DI 255
        DI 14                 //! no-such-interrupt
        STOP
        Handler: RETI",
    );
}

#[test]
fn coordinates_and_variables_that_do_not_exist() {
    tells_of_commands(
        "SCO 20, 0, -5
        SCO 21, 0, 5          //! no-such-coordinate
        GCO 21, 255           //! no-such-coordinate
        CCO 21, 0             //! no-such-coordinate
        ACO 255, 0            //! no-such-coordinate
        MVP COORD, 0, 20
        MVP COORD, $85, 21    //! no-such-coordinate
        MVP COORD, 0, -1      //! no-such-coordinate
        CALCVV ADD, 255, 255
        CALCVV ADD, 0, 256    //! no-such-variable
        CALCVV ADD, 0, -1     //! no-such-variable
        CALCVA ADD, 255
        DJNZ 255, 0",
    );
}

#[test]
fn operations_that_a_command_does_not_have() {
    tells_of_commands(
        "CALC NOT
        CALC SWAP, 0      //! no-such-operation
        CALC COMP, 0      //! no-such-operation
        CALCX SWAP
        CALCX COMP        //! no-such-operation
        CALCV COMP, 1, 2
        CALCV SWAP, 1, 2  //! no-such-operation
        CALCVV SWAP, 1, 2
        CALCAV COMP, 1
        CALCXV 12, 1      //! no-such-operation
        JC ESD, 0
        JC 13, 0          //! no-such-operation
        CLE 6             //! no-such-operation
        // What the motor is for depends on it.
        MVP 3, 9, 0       //! no-such-operation
        RFS 3, 0          //! no-such-operation
        WAIT 5, 0, 0      //! no-such-operation",
    );
    says(
        "CALC COMP, 5\nRFS 7, 0",
        &[
            "COMP | CALC has no COMP | COMP compares the accumulator with a value",
            "7 | RFS has no action 7 | it has START (0), STOP (1), STATUS (2)",
        ],
    );
}

#[test]
fn times_below_zero() {
    tells_of_commands(
        "WAIT TICKS, 0, -1
        WAIT TICKS, 0, -2  //! negative-time
        WAIT POS, 0, -100  //! negative-time",
    );
}

#[test]
fn what_the_assembler_has_told_is_not_told_again() {
    use opentmcl_lang::include::BuiltInOnly;
    let text = "SAP 6, 0, Curent\nMST Motor9\nGIO 300, 0\nJA Nowhere\nFOO 7\nMST 6";
    let assembly = opentmcl_lang::assemble("main.tmc", text, &mut BuiltInOnly, Default::default());
    let findings = opentmcl_lang::check::findings(&assembly, Some(tmcm_6214()));
    let told: Vec<_> = findings.iter().map(|finding| finding.code.name()).collect();
    assert_eq!(
        told,
        [
            "unknown-constant",
            "unknown-constant",
            "value-too-large",
            "unknown-label",
            "unknown-command",
            "no-such-axis",
        ]
    );
}
