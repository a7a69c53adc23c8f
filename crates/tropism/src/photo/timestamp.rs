//! Times in the names of photographs.

use super::name_order::words_and_numbers;

/// The time in the name of a file, in seconds since 1970; `None` for a name without one.
///
/// Three forms are read: year to second or minute, with or without separators; month to second in pairs of digits
/// with separators; ten or thirteen digits, which are Unix time in seconds or milliseconds.
///
/// ```
/// use tropism::photo::time_in_name;
/// assert_eq!(time_in_name("IMG_20240501_130500.jpg"), time_in_name("2024-05-01T13h05.png"));
/// assert_eq!(time_in_name("1714568700.jpg"), time_in_name("IMG_20240501_130500.jpg"));
/// assert_eq!(time_in_name("frame000123.jpg"), None);
/// ```
#[must_use]
pub fn time_in_name(name: &str) -> Option<f64> {
    // Groups of digits, each with the number of bytes between it and the group before.
    let parts = words_and_numbers(name).into_iter().filter(|(_, digits)| !digits.is_empty());
    let groups: Vec<(usize, &str)> = parts.map(|(word, digits)| (word.len(), digits)).collect();
    (0..groups.len()).find_map(|first| {
        let groups = &groups[first..];
        unix_time(groups[0].1).or_else(|| calendar_time(groups)).or_else(|| yearless_time(groups))
    })
}

/// Unix time in seconds or milliseconds, from 2001 to 2286.
fn unix_time(group: &str) -> Option<f64> {
    let number: f64 = group.parse().ok()?;
    match group.len() {
        10 if group.as_bytes()[0] != b'0' => Some(number),
        13 if group.as_bytes()[0] != b'0' => Some(number / 1e3),
        _ => None,
    }
}

/// Year to second or to minute, from groups of whole fields with at most two separators between them.
fn calendar_time(groups: &[(usize, &str)]) -> Option<f64> {
    let mut text = String::new();
    for (index, (gap, group)) in groups.iter().enumerate() {
        let is_apart = index > 0 && *gap > 2;
        let is_whole = [4, 6, 8, 10, 12, 14].contains(&(text.len() + group.len()));
        if is_apart || !is_whole {
            break;
        }
        text += group;
    }
    let pair = |start: usize| text.get(start..start + 2).and_then(|pair| pair.parse::<u32>().ok());
    let year = text.get(..4)?.parse().ok()?;
    let second = if text.len() == 14 { pair(12)? } else { 0 };
    unix_seconds(year, [pair(4)?, pair(6)?, pair(8)?, pair(10)?, second])
}

/// Month to second in five groups of two digits, in the year 1970, as the name has none.
fn yearless_time(groups: &[(usize, &str)]) -> Option<f64> {
    let five = groups.get(..5).filter(|five| five.iter().all(|(_, group)| group.len() == 2))?;
    if five[1..].iter().any(|(gap, _)| !(1..=2).contains(gap)) {
        return None;
    }
    let number = |at: usize| five[at].1.parse::<u32>().ok();
    unix_seconds(1970, [number(0)?, number(1)?, number(2)?, number(3)?, number(4)?])
}

/// Seconds since 1970 at a date and time of the Gregorian calendar; `None` for a date that does not exist or lies
/// outside 1970 to 2199.
pub(super) fn unix_seconds(year: u32, [month, day, hour, minute, second]: [u32; 5]) -> Option<f64> {
    let is_leap =
        |year: u32| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let length = |month: u32| match month {
        2 => 28 + u32::from(is_leap(year)),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    let is_date =
        (1970..2200).contains(&year) && (1..=12).contains(&month) && day >= 1 && day <= length(month);
    if !(is_date && hour < 24 && minute < 60 && second <= 60) {
        return None;
    }
    let years: u32 = (1970..year).map(|year| 365 + u32::from(is_leap(year))).sum();
    let days = years + (1..month).map(length).sum::<u32>() + day - 1;
    Some(f64::from(days) * 86_400.0 + f64::from(hour * 3_600 + minute * 60 + second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_from_names() {
        let noon = time_in_name("20240301120000").unwrap();
        for name in [
            "2024-03-01_12-00-00.jpg",
            "2024-03-01T12:00:00Z.png",
            "cam1_20240301-1200.jpg",
            "plant_3 2024.03.01 12h00m00s.jpg",
            "IMG_20240301_120000_0042.jpg",
            "1709294400.jpg",
            "cam 1709294400000.jpg",
        ] {
            assert_eq!(time_in_name(name), Some(noon), "{name}");
        }
        let yearless = |name| time_in_name(name).unwrap();
        assert_eq!(yearless("03_02__17_10_53.jpg") - yearless("03_02__17_09_52.jpg"), 61.0);
        for name in [
            "0001.jpg",
            "IMG-20240301-WA0003.jpg",
            "20241301_120000.jpg",
            "20240230_120000.jpg",
            "a.jpg",
            "frame123456789.jpg",
        ] {
            assert_eq!(time_in_name(name), None, "{name}");
        }
        assert_eq!(time_in_name("1970-01-02 00:00:01"), Some(86_401.0));
        assert!(time_in_name("20240229_000000").is_some() && time_in_name("21000229_000000").is_none());
    }
}
