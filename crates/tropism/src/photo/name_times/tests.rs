use super::*;

/// A calendar date and time of day, as a name may hold it.
#[derive(Clone, Copy)]
struct Stamp {
    year: u32,
    month: u32,
    day: u32,
    hour: u32,
    minute: u32,
    second: u32,
}

/// `count` stamps every `period_min` from 9 o'clock on the 12th of October 2024, and their times in seconds.
fn stamps(count: usize, period_min: u32) -> (Vec<Stamp>, Vec<f64>) {
    let start = unix_seconds(2024, [10, 12, 9, 0, 0]).unwrap();
    let times: Vec<f64> = (0..count).map(|index| start + f64::from(period_min * 60) * index as f64).collect();
    (times.iter().map(|time| stamp(*time)).collect(), times)
}

/// October and November only.
fn stamp(time: f64) -> Stamp {
    let start = unix_seconds(2024, [10, 1, 0, 0, 0]).unwrap();
    let seconds = (time - start) as u32;
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let (month, day) = if days < 31 { (10, days + 1) } else { (11, days - 30) };
    Stamp { year: 2024, month, day, hour: rest / 3_600, minute: rest / 60 % 60, second: rest % 60 }
}

/// The times of names in natural order, as the program lists them.
fn read(mut names: Vec<(String, f64)>) -> (NameTimes, Vec<f64>) {
    names.sort_by_cached_key(|(name, _)| super::super::natural_order(name));
    let (names, truth): (Vec<String>, Vec<f64>) = names.into_iter().unzip();
    (times_in_names(&names), truth)
}

/// Checks that times are the truth but for an offset, to the minute where names say no more.
fn assert_right(label: &str, form: impl Fn(usize, Stamp) -> String, count: usize, period_min: u32) {
    let (stamps, times) = stamps(count, period_min);
    let names = stamps.iter().enumerate().map(|(index, stamp)| form(index, *stamp)).zip(times);
    let (found, truth) = read(names.collect());
    assert_eq!(found.times.len(), count, "{label}: {found:?}");
    let offset = found.times[0].unwrap() - truth[0];
    for (time, truth) in found.times.iter().zip(&truth) {
        assert!((time.unwrap() - truth - offset).abs() < 1.0, "{label}: {time:?}, wanted {truth}");
    }
    assert!(found.warnings.is_empty(), "{label}: {:?}", found.warnings);
}

type Form = fn(usize, Stamp) -> String;

#[test]
fn names_of_cameras_and_programs_are_read() {
    let forms: [(&str, Form); 33] = [
        ("pixel", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("PXL_{year}{month:02}{day:02}_{hour:02}{minute:02}{second:02}123.jpg")
        }),
        ("rpicam --datetime", |_, Stamp { month, day, hour, minute, second, .. }| {
            format!("{month:02}{day:02}{hour:02}{minute:02}{second:02}.jpg")
        }),
        ("motionEye", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{year}-{month:02}-{day:02}/{hour:02}-{minute:02}-{second:02}.jpg")
        }),
        ("serial", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("cam1420987654_{year}{month:02}{day:02}_{hour:02}{minute:02}{second:02}.jpg")
        }),
        ("short", |_, Stamp { month, day, hour, minute, second, .. }| {
            format!("24{month:02}{day:02}_{hour:02}{minute:02}{second:02}.jpg")
        }),
        ("short, together", |_, Stamp { month, day, hour, minute, second, .. }| {
            format!("24{month:02}{day:02}{hour:02}{minute:02}{second:02}.jpg")
        }),
        ("short, minutes", |_, Stamp { month, day, hour, minute, .. }| {
            format!("24{month:02}{day:02}{hour:02}{minute:02}.jpg")
        }),
        ("offset", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{year}-{month:02}-{day:02}T{hour:02}-{minute:02}-{second:02}+0200.jpg")
        }),
        ("Dahua", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{year}-{month:02}-{day:02}/001/jpg/{hour:02}/{minute:02}/{second:02}[M][0@0][0].jpg")
        }),
        ("Hikvision", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("192.168.1.64_01_{year}{month:02}{day:02}{hour:02}{minute:02}{second:02}789_TIMING.jpg")
        }),
        ("Reolink", |_, Stamp { year, month, day, hour, minute, second }| {
            format!(
                "{year}/{month:02}/{day:02}/Cam-00-{year}{month:02}{day:02}{hour:02}{minute:02}{second:02}.jpg"
            )
        }),
        ("day first", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{day:02}-{month:02}-{year}_{hour:02}-{minute:02}-{second:02}.png")
        }),
        ("month first", |_, Stamp { year, month, day, hour, minute, .. }| {
            format!("{month:02}.{day:02}.{year} {hour:02}h{minute:02}.png")
        }),
        ("macOS", |_, Stamp { year, month, day, hour, minute, second }| {
            let (half, twelve) = (if hour < 12 { "AM" } else { "PM" }, (hour + 11) % 12 + 1);
            format!("Screenshot {year}-{month:02}-{day:02} at {twelve}.{minute:02}.{second:02} {half}.png")
        }),
        ("month in letters", |_, Stamp { year, month, day, hour, minute, .. }| {
            format!("{day:02}-{}-{year} {hour:02}-{minute:02}.jpg", if month == 10 { "Oct" } else { "Nov" })
        }),
        ("month in German", |_, Stamp { year, month, day, hour, minute, .. }| {
            format!("{day:02}-{}-{year} {hour:02}-{minute:02}.jpg", if month == 10 { "Okt" } else { "Nov" })
        }),
        ("month in Spanish", |_, Stamp { year, month, day, hour, minute, .. }| {
            let name = if month == 10 { "octubre" } else { "noviembre" };
            format!("{day} de {name} de {year} {hour:02}.{minute:02}.jpg")
        }),
        ("month in letters, short year", |_, Stamp { month, day, hour, minute, .. }| {
            format!("{day:02}-{}-24 {hour:02}.{minute:02}.jpg", if month == 10 { "Oct" } else { "Nov" })
        }),
        ("folder with a digit", |_, Stamp { month, day, hour, minute, .. }| {
            format!("beans3/{month:02}{day:02}{hour:02}{minute:02}.jpg")
        }),
        ("numbered plant", |_, Stamp { month, day, hour, minute, .. }| {
            format!("plant-2/{month:02}{day:02}{hour:02}{minute:02}.jpg")
        }),
        ("numbered bean", |_, Stamp { month, day, hour, minute, .. }| {
            format!("bean3_{month:02}{day:02}_{hour:02}{minute:02}.jpg")
        }),
        ("numbered camera", |_, Stamp { month, day, hour, minute, .. }| {
            format!("cam1-{month:02}-{day:02}_{hour:02}-{minute:02}.jpg")
        }),
        ("numbered folder, time first", |_, Stamp { month, day, hour, minute, .. }| {
            format!("beans3/{hour:02}{minute:02}_{day:02}{month:02}24.jpg")
        }),
        ("elapsed", |_, Stamp { day, hour, minute, .. }| {
            format!("bean_{}d_{hour:02}h_{minute:02}min.jpg", day - 11)
        }),
        ("zone", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{year}-{month:02}-{day:02} {hour:02}.{minute:02}.{second:02} CEST.jpg")
        }),
        ("month first, no year", |_, Stamp { month, day, hour, minute, second, .. }| {
            format!("IMG_{month:02}-{day:02}_{hour:02}-{minute:02}-{second:02}.jpg")
        }),
        ("time first", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{hour:02}{minute:02}{second:02}_{year}{month:02}{day:02}.jpg")
        }),
        ("folder of a day", |_, Stamp { year, month, day, hour, minute, .. }| {
            format!("{year}{month:02}{day:02}/{hour:02}{minute:02}.jpg")
        }),
        ("folders of day and hour", |_, Stamp { year, month, day, hour, minute, second }| {
            format!("{year}/{month:02}/{day:02}/{hour:02}/{minute:02}.{second:02}.jpg")
        }),
        ("numbered days", |_, Stamp { day, hour, minute, second, .. }| {
            format!("day{}/{hour:02}-{minute:02}-{second:02}.jpg", day - 11)
        }),
        ("number before", |index, Stamp { hour, minute, second, .. }| {
            format!("{index:04}_{hour:02}-{minute:02}-{second:02}.jpg")
        }),
        ("number before, twelve hours", |index, Stamp { hour, minute, second, .. }| {
            format!("{index:04}_{:02}-{minute:02}-{second:02}.jpg", (hour + 11) % 12 + 1)
        }),
        ("day and month", |_, Stamp { month, day, hour, minute, second, .. }| {
            format!("{month:02}_{day:02}__{hour:02}_{minute:02}_{second:02}.jpg")
        }),
    ];
    for (label, form) in forms {
        assert_right(label, form, 60, 5);
        assert_right(label, form, 400, 5);
        assert_right(label, form, 150, 13);
    }
}

#[test]
fn unix_times_are_read() {
    for digits in [1.0, 1e3, 1e6] {
        let (_, times) = stamps(60, 5);
        let names = times.iter().map(|time| (format!("cam {}.jpg", (time * digits) as u64), *time));
        let (found, truth) = read(names.collect());
        assert_eq!(found.times, truth.into_iter().map(Some).collect::<Vec<_>>());
    }
}

#[test]
fn a_night_is_whole_where_names_have_no_date() {
    let (stamps, times) = stamps(240, 5);
    let night = stamps.iter().zip(times).skip(120);
    let names = night.map(|(stamp, time)| (format!("{:02}{:02}00.jpg", stamp.hour, stamp.minute), time));
    let (found, truth) = read(names.collect());
    let offset = found.times[0].unwrap() - truth[0];
    assert!(found.times.iter().zip(&truth).all(|(time, truth)| time.unwrap() - truth == offset), "{found:?}");
}

#[test]
fn counters_are_no_clock() {
    let none: [fn(usize) -> String; 6] = [
        |index| format!("{index:04}.jpg"),
        |index| format!("frame{}.jpg", 123_000_000 + index),
        |index| format!("DSC{:05}.jpg", 1_200 + index),
        |index| format!("IMG_{:04}.jpg", 900 + 5 * index),
        |index| format!("d1_f{index}.jpg"),
        |index| format!("{:06}.jpg", 101_010 + index),
    ];
    for (place, form) in none.into_iter().enumerate() {
        let found = times_in_names(&(0..90).map(form).collect::<Vec<_>>());
        assert_eq!(found.times, [], "{place}: {found:?}");
    }
    let found = times_in_names(&["IMG-20240301-WA0003.jpg", "IMG-20240301-WA0004.jpg"].map(str::to_owned));
    assert_eq!(found.times, []);
}

/// How names are read: whether they tell times, and how many warnings there are.
fn outcome(names: Vec<String>) -> (bool, usize) {
    let mut names = names;
    names.sort_by_cached_key(|name| super::super::natural_order(name));
    let found = times_in_names(&names);
    (!found.times.is_empty(), found.warnings.len())
}

#[test]
fn counters_beside_a_date_are_counted() {
    let forms: [fn(usize) -> String; 8] = [
        |index| format!("bean_2024-05-01/frame{:04}.jpg", index + 1),
        |index| format!("2024-05-01/IMG_{:04}.jpg", index + 1),
        |index| format!("20240501/frame{index:04}.jpg"),
        |index| format!("bean_2024-05-01_{:04}.jpg", index + 1),
        |index| format!("bean_20240501_{:06}.jpg", index + 1),
        |index| format!("tl_20240501_0900/frame_{:06}.jpg", index + 1),
        |index| format!("2024-05-01_09-00-00_{:04}.jpg", index + 1),
        |index| format!("day{}/IMG{:02}.jpg", 1 + index / 12, 1 + index % 12),
    ];
    for (place, form) in forms.into_iter().enumerate() {
        for count in [24, 70] {
            assert_eq!(outcome((0..count).map(form).collect()), (false, 0), "{place}, {count}");
        }
    }
    // A number from 900 on may be a clock.
    assert_eq!(
        outcome((0..40).map(|index| format!("2024-05-01/{:04}.jpg", 900 + index)).collect()),
        (false, 1)
    );
    // Beyond the hour it is one.
    let of_clock = |index: usize| format!("2024-05-01/{:02}{:02}.jpg", 9 + index / 60, index % 60);
    assert_eq!(outcome((0..90).map(of_clock).collect()), (true, 0));
}

#[test]
fn an_odd_file_makes_no_clock_of_a_counter() {
    for odd in ["IMG_0016 (1).jpg", "checkerboard.jpg", "IMG_0016a.jpg"] {
        let mut names: Vec<String> = (0..40).map(|index| format!("IMG_{index:04}.jpg")).collect();
        names.push(odd.to_owned());
        assert_eq!(outcome(names), (false, 1), "{odd}");
    }
}

#[test]
fn numbers_that_begin_anew_are_no_clock() {
    for after in [14, 25, 60] {
        let names =
            |index: usize| format!("IMG_{:04}.jpg", if index < 15 { 9985 + index } else { index - 14 });
        assert!(!outcome((0..15 + after).map(names).collect()).0, "{after}");
    }
}

#[test]
fn a_number_behind_a_whole_clock_is_none_of_its_fields() {
    let (stamps, times): (Vec<Stamp>, Vec<f64>) = {
        let start = unix_seconds(2024, [10, 12, 22, 59, 1]).unwrap();
        let times: Vec<f64> = (0..20).map(|index| start + 301.0 * f64::from(index)).collect();
        (times.iter().map(|time| stamp(*time)).collect(), times)
    };
    for tail in ["(1)", "-1", "__2", "-00"] {
        let name = |stamp: &Stamp| {
            let Stamp { year, month, day, hour, minute, second } = stamp;
            format!("{year}-{month:02}-{day:02}__{hour:02}-{minute:02}-{second:02}{tail}.JPG")
        };
        let (found, truth) = read(stamps.iter().map(name).zip(times.iter().copied()).collect());
        assert_eq!(found.times, truth.into_iter().map(Some).collect::<Vec<_>>(), "{tail}");
    }
    // The number of the folder is no part of the date.
    let name = |stamp: &Stamp| {
        let Stamp { month, day, hour, minute, second, .. } = stamp;
        format!("plant3601/{month:02}{day:02}{hour:02}{minute:02}{second:02}.jpg")
    };
    let hourly = (0..24).map(|hour| times[0] + 3601.0 * f64::from(hour));
    let (found, truth) = read(hourly.map(|time| (name(&stamp(time)), time)).collect());
    assert!(found.times[1].unwrap() - found.times[0].unwrap() == truth[1] - truth[0], "{found:?}");
}

#[test]
fn the_end_of_summer_time_is_undone_by_numbers() {
    let (stamps, times) = stamps(60, 5);
    let names = stamps.iter().zip(times).enumerate().map(|(index, (stamp, time))| {
        let hour = if index < 24 { stamp.hour } else { stamp.hour - 1 };
        (format!("IMG_20241027_{hour:02}{:02}00_{index:04}.jpg", stamp.minute), time)
    });
    let (found, truth) = read(names.collect());
    let offset = found.times[0].unwrap() - truth[0];
    assert!(found.times.iter().zip(&truth).all(|(time, truth)| time.unwrap() - truth == offset), "{found:?}");
    assert!(found.notes[0].contains("summer time") && found.warnings.is_empty(), "{found:?}");
}

#[test]
fn a_clock_that_was_set_is_said() {
    let (stamps, times) = stamps(60, 5);
    let names = stamps.iter().zip(times).enumerate().map(|(index, (stamp, time))| {
        let year = if index < 3 { 2023 } else { 2024 };
        (format!("{year}10{:02}_{:02}{:02}00.jpg", stamp.day, stamp.hour, stamp.minute), time)
    });
    let (found, _) = read(names.collect());
    assert!(found.warnings[0].contains("a gap of 366 days"), "{found:?}");
    // By numbers, which go on while the clock goes back.
    let names: Vec<String> = (0..60)
        .map(|index| {
            format!(
                "{index:04}_20241012_{:02}{:02}00.jpg",
                if index < 30 { 12 } else { 8 } + index / 12 % 5,
                index % 12 * 5
            )
        })
        .collect();
    let found = times_in_names(&names);
    assert!(found.warnings.iter().any(|warning| warning.contains("different orders")), "{found:?}");
}

#[test]
fn ambiguous_days_and_months_are_said() {
    let names: Vec<String> = (1..=10).map(|day| format!("{day:02}-{day:02}-2024_12-00-00.jpg")).collect();
    let found = times_in_names(&names);
    assert!(found.warnings.is_empty() && found.times.len() == 10, "{found:?}");
    let names: Vec<String> = (1..=6).map(|day| format!("{day:02}-10-2024_12-00-00.jpg")).collect();
    let found = times_in_names(&names);
    assert!(found.warnings[0].contains("ambiguous"), "{found:?}");
    assert_eq!(found.times[1].unwrap() - found.times[0].unwrap(), DAY_S);
}

#[test]
fn irregular_photographs_with_full_dates_are_read() {
    let names = ["b_20240501_120000.jpg", "b_20240501_121000.jpg", "b_20240501_120500.jpg", "broken.jpg"];
    let found = times_in_names(&names.map(str::to_owned));
    assert!(found.is_plain && found.times[3].is_none() && found.times[0].is_some(), "{found:?}");
}

#[test]
fn zones_tell_the_hours_of_autumn_apart() {
    let names = ["01.55 CEST", "02.55 CEST", "02.55 CET", "03.55 CET"]
        .map(|time| format!("2024-10-27 {}.00 {}.jpg", &time[..5], &time[6..]));
    let found = times_in_names(&names);
    let start = found.times[0].unwrap();
    let hours: Vec<f64> = found.times.iter().map(|time| (time.unwrap() - start) / 3_600.0).collect();
    assert_eq!((hours, found.warnings.len()), (vec![0.0, 1.0, 2.0, 3.0], 0));
}

#[test]
fn names_of_which_some_have_a_date_are_counted_with_a_warning() {
    let half = |index: usize| match index {
        0..20 => format!("IMG_20240503_20{:02}00.jpg", 2 * index),
        _ => format!("04.05.2024 01.{:02}.00.jpg", index),
    };
    assert_eq!(outcome((0..40).map(half).collect()), (false, 1));
    let burst = |index: usize| format!("IMG_20241026_2{}0000_BURST{:03}.jpg", index / 20, index % 20);
    assert_eq!(outcome((0..40).map(burst).collect()), (false, 1));
}

#[test]
fn what_is_less_than_a_second_and_more_than_a_minute_apart_is_told() {
    let five_a_second = |index: usize| format!("20240501_2359{:02}{}00.jpg", 50 + index / 5, 2 * (index % 5));
    let found = times_in_names(&(0..40).map(five_a_second).collect::<Vec<_>>());
    assert!((found.times[39].unwrap() - found.times[0].unwrap() - 7.8).abs() < 1e-6, "{found:?}");
    let within_a_minute = |index: usize| format!("2024-10-26_23-{}_{}.jpg", 10 + index / 6, index % 6);
    let found = times_in_names(&(0..60).map(within_a_minute).collect::<Vec<_>>());
    assert!(
        found.times.is_empty() || (found.times[59].unwrap() - found.times[0].unwrap() - 540.0).abs() < 60.0
    );
}
