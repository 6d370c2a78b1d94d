//! Values of the options of `tmcl sim` that are of the form `N=VALUE`.

/// Level of an input: `N=high` or `N=low`.
pub(super) fn parse_input(text: &str) -> Result<(u8, bool), String> {
    let expected = || "write the number of the input and its level: 3=high or 3=low".to_owned();
    let (number, level) = text.split_once('=').ok_or_else(expected)?;
    let level = match level.to_ascii_lowercase().as_str() {
        "high" | "1" => true,
        "low" | "0" => false,
        _ => return Err(expected()),
    };
    Ok((number.parse().map_err(|_| expected())?, level))
}

/// Reading of an analog input: `N=READING`.
pub(super) fn parse_analog(text: &str) -> Result<(u8, u16), String> {
    let expected = || "write the number of the input and its reading: 0=2048".to_owned();
    let (number, reading) = text.split_once('=').ok_or_else(expected)?;
    Ok((number.parse().map_err(|_| expected())?, reading.parse().map_err(|_| expected())?))
}

/// Value of a user variable: `N=VALUE`.
pub(super) fn parse_variable(text: &str) -> Result<(u8, i32), String> {
    let expected = || "write a variable from 0 to 255 and its value: 42=1000".to_owned();
    let (number, value) = text.split_once('=').ok_or_else(expected)?;
    Ok((number.parse().map_err(|_| expected())?, value.parse().map_err(|_| expected())?))
}
