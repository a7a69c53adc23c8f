//! Times of a series of photographs, from their names and folders together.
//!
//! One name says little: `1012090000` is Unix time, or 9 o'clock on the 12th of October. The one idea: a right reading makes the
//! intervals of a series even, and a wrong one does not, as digits that are taken for seconds jump where minutes become an
//! hour. So all readings of all names are tried, and the one that is most even, of the most usual form, is taken. What is
//! ambiguous, and what a camera's clock did meanwhile, is said.

use std::collections::BTreeMap;

use super::name_order::words_and_numbers;
use super::timestamp::unix_seconds;
use crate::math::statistics::median;

const HOUR_S: f64 = 3_600.0;
const DAY_S: f64 = 86_400.0;

/// The times of a series, as far as its names tell them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NameTimes {
    /// Seconds since 1970 of each photograph, on the camera's clock or in UTC; `None` for names without a time. Empty if the
    /// names tell no times.
    ///
    /// Where names have no year or no date, all times are off by the same.
    pub times: Vec<Option<f64>>,
    /// What may be wrong with the times, or with counting in place of them: a sentence each.
    pub warnings: Vec<String>,
    /// What was corrected: a sentence each.
    pub notes: Vec<String>,
    /// Whether each name alone says all: year, month and day in this order, the year in full.
    pub is_plain: bool,
}

/// Reads the times of photographs from their paths, which come in the order of their names. Of the folders, the last six
/// are read.
#[must_use]
pub fn times_in_names(paths: &[String]) -> NameTimes {
    let names: Vec<Name<'_>> = paths.iter().map(|path| Name::new(path)).collect();
    let alike = alike(&names);
    let counted = |warning: Option<String>| {
        let first_unlike = (0..names.len()).find(|&index| alike.get(index) != Some(&index));
        let unlike = first_unlike.map(|index| {
            format!(
                "{:?} has no name like the others, and is counted as one of them: leave it out if it is none of the series",
                paths[index]
            )
        });
        NameTimes { warnings: warning.into_iter().chain(unlike).collect(), ..NameTimes::default() }
    };
    let readings = readings_of(&names, &alike);
    // Times of day alone never lie far apart.
    let closest = readings.iter().filter(|reading| reading.rank() < 5 && reading.even >= LEAST_EVEN);
    let closest = closest.map(|reading| reading.spread).min();
    let is_torn = |reading: &Reading| {
        reading.rank() > 0 && closest.is_some_and(|closest| reading.spread >= 4 * (closest + 1))
    };
    let is_eligible = |reading: &&Reading| {
        let beats = |other: &Reading| {
            let lead = if other.rank() <= reading.rank() { EVEN_MARGIN } else { PART_MARGIN };
            !is_torn(other) && other.even > reading.even + lead
        };
        reading.rank() == 0 || !is_torn(reading) && !readings.iter().any(beats)
    };
    let chosen = readings
        .iter()
        .filter(is_eligible)
        .min_by(|one, other| one.rank().cmp(&other.rank()).then(one.spread.cmp(&other.spread)));
    let counter = rise_of_counter(&names, &alike);
    let Some(chosen) = chosen else {
        let is_counter = counter.is_some_and(|(_, even)| even >= LEAST_COUNTED);
        return counted(some_have_dates(&names).filter(|_| !is_counter));
    };
    let rank = chosen.rank();
    // So few digits are a counter, if they rise as evenly as the clock would.
    let is_whole_clock = matches!(chosen.form, Form::Calendar { clock: Clock::Seconds, .. })
        && chosen.used().is_some_and(|(first, last)| last == first + 2);
    let is_counter = rank >= if counter.is_some_and(|(rise, _)| rise == 1) { 3 } else { 5 }
        && !is_whole_clock
        && counter.is_some_and(|(_, even)| even >= chosen.even);
    if is_counter {
        let may_be_days = rank == 3 && chosen.times.iter().all(Option::is_some);
        let warning =
            format!("the numbers in the names may be a clock ({}), and are counted", chosen.form.words());
        return counted(may_be_days.then_some(warning));
    }
    // A number that rises by one beside a date, and as evenly as the clock would: a clock that shows minutes or seconds alone,
    // or a counter, which is plain where it begins with 0 or 1.
    if let Some(first) = chosen.first_of_counter(&names, &alike) {
        let words = chosen.form.words();
        let warning = format!(
            "the last number in the names may be a clock ({words}) or a counter, and is taken for a counter"
        );
        return counted((first > 1).then_some(warning));
    }
    if rank >= 2 && chosen.even < LEAST_EVEN {
        // Counting would take a jump of the hour for a gap.
        let warning = format!(
            "the digits in the names may be a clock ({}), but the intervals do not come out even, so the photographs are counted",
            chosen.form.words()
        );
        let is_counted = counter.is_some_and(|(_, even)| even > chosen.even);
        return counted((!is_counted && rank < 5).then_some(warning));
    }
    let mut found = NameTimes { times: chosen.times.clone(), is_plain: rank == 0, ..NameTimes::default() };
    let rival = readings.iter().filter(is_eligible).find(|other| {
        rank > 0
            && other.rank() <= rank + 1
            // Minutes and seconds look like hours and minutes: only dates compete, and what may be a label.
            && (other.form.date() != chosen.form.date() || other.is_labelled)
            && !are_the_same(&other.times, &chosen.times)
    });
    if let Some(rival) = rival {
        found.warnings.push(format!(
            "the times in the names are ambiguous: read as {}, but {} comes out as even",
            chosen.form.words(),
            rival.form.words()
        ));
    }
    chosen.check_clock(&names, &alike, &mut found);
    found
}

/// Share of names with a date and a time above which it is said that the photographs are counted all the same. Chosen by hand.
const OFTEN: f64 = 0.2;

/// Whether names have full dates with times, though no reading of them is one of the series.
fn some_have_dates(names: &[Name<'_>]) -> Option<String> {
    let forms: Vec<Form> = Form::all().into_iter().filter(|form| form.rank() == 0).collect();
    let time = |name: &Name<'_>| {
        let moment = |form: &Form| (0..name.groups.len()).find_map(|first| form.read(name, first));
        forms.iter().find_map(moment).map(|moment| moment.seconds)
    };
    let times: Vec<f64> = names.iter().filter_map(time).collect();
    let differ = times.iter().any(|time| *time != times[0]);
    (differ && times.len() as f64 > OFTEN * names.len() as f64).then(|| {
        format!(
            "{} of {} names tell date and time, but the others do not, or many tell the same: the photographs are counted",
            times.len(),
            names.len()
        )
    })
}

/// Share of the intervals by which a reading may be less even than one that is as usual. Chosen: one interval in a hundred.
const EVEN_MARGIN: f64 = 0.01;

/// The same, of one that is less usual, or a part of its digits. Chosen: a coarser clock hides photographs that are missing, some
/// tenth of them, and digits that are taken for another field jump in a twelfth of the intervals.
const PART_MARGIN: f64 = 0.25;

/// Least share of even intervals of a reading that is not a full date. Chosen: with fewer the median interval means little.
const LEAST_EVEN: f64 = 0.5;

/// Least share of even intervals of times of day without a date, below which days may be mixed. Chosen: one odd one in fifty.
const LEAST_EVEN_OF_DAY: f64 = 0.98;

/// A path, without the ending of its file: its numbers, and the words before and behind each.
struct Name<'a> {
    groups: Vec<(&'a str, &'a str)>,
    end: &'a str,
}

impl<'a> Name<'a> {
    fn new(path: &'a str) -> Self {
        let (folders, file) = path.rsplit_once(['/', '\\']).unwrap_or(("", path));
        let stem = file.rsplit_once('.').filter(|(stem, _)| !stem.is_empty()).map_or(file, |(stem, _)| stem);
        // Six folders: year, month, day, and those of a recorder between them and hour and minute.
        let start = folders.rmatch_indices(['/', '\\']).nth(5).map_or(0, |(at, _)| at + 1);
        let text = &path[start..path.len() - file.len() + stem.len()];
        let mut groups = words_and_numbers(text);
        let end = match groups.last() {
            Some((word, "")) => {
                let word = *word;
                groups.pop();
                word
            }
            _ => "",
        };
        Self { groups, end }
    }

    /// The word behind a group.
    fn word_after(&self, group: usize) -> &'a str {
        self.groups.get(group + 1).map_or(self.end, |(word, _)| word)
    }
}

/// The places of the names that are like most: the same words around as many numbers. All, where fewer than four fifths are
/// alike: then no form is usual.
fn alike(names: &[Name<'_>]) -> Vec<usize> {
    let mut by_form: BTreeMap<(Vec<&str>, &str), Vec<usize>> = BTreeMap::new();
    for (index, name) in names.iter().enumerate() {
        // Folders differ: the last of them begins the words that count.
        let words =
            name.groups.iter().map(|(word, _)| word.rsplit(['/', '\\']).next().unwrap_or(word)).collect();
        by_form.entry((words, name.end)).or_default().push(index);
    }
    let most = by_form.into_values().max_by_key(Vec::len).unwrap_or_default();
    if 5 * most.len() >= 4 * names.len() { most } else { (0..names.len()).collect() }
}

/// Fields of a date in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Date {
    YearMonthDay,
    /// With the month in letters.
    YearNameDay,
    DayNameYear,
    NameDayYear,
    DayMonthYear,
    MonthDayYear,
    DayNameShortYear,
    ShortYearMonthDay,
    DayMonthShortYear,
    MonthDayShortYear,
    YearDay,
    /// With the month in letters, and the year behind the time or nowhere.
    NameDay,
    MonthDay,
    DayMonth,
    None,
}

/// Fields of a time of day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Clock {
    Seconds,
    Minutes,
    Hours,
    None,
}

/// How names are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// A date and a time of day. `skip` numbers stand between them, the same in all names.
    Calendar { date: Date, clock: Clock, skip: usize, is_time_first: bool },
    /// Seconds, milliseconds or microseconds since 1970, by the number of digits.
    Unix { digits: usize },
}

const DATES: [Date; 15] = [
    Date::YearMonthDay,
    Date::YearNameDay,
    Date::DayNameYear,
    Date::NameDayYear,
    Date::DayMonthYear,
    Date::MonthDayYear,
    Date::DayNameShortYear,
    Date::ShortYearMonthDay,
    Date::DayMonthShortYear,
    Date::MonthDayShortYear,
    Date::YearDay,
    Date::NameDay,
    Date::MonthDay,
    Date::DayMonth,
    Date::None,
];

impl Form {
    /// All forms, the most usual first.
    fn all() -> Vec<Self> {
        let mut all: Vec<Self> = [10, 13, 16].map(|digits| Self::Unix { digits }).to_vec();
        for date in DATES {
            for clock in [Clock::Seconds, Clock::Minutes, Clock::Hours, Clock::None] {
                match (date, clock) {
                    (Date::None, Clock::Hours | Clock::None) => {}
                    (Date::None, _) | (_, Clock::None) => {
                        all.push(Self::Calendar { date, clock, skip: 0, is_time_first: false });
                    }
                    _ => {
                        all.extend((0..4).map(|skip| Self::Calendar {
                            date,
                            clock,
                            skip,
                            is_time_first: false,
                        }));
                        all.push(Self::Calendar { date, clock, skip: 0, is_time_first: true });
                    }
                }
            }
        }
        all
    }

    /// How unusual it is, from 0: a full date that can hardly be anything else.
    fn rank(self) -> u32 {
        let Self::Calendar { date, clock, skip, is_time_first } = self else { return 1 };
        let of_date = match date {
            Date::YearMonthDay | Date::YearNameDay | Date::DayNameYear | Date::NameDayYear => 0,
            Date::DayMonthYear | Date::MonthDayYear | Date::DayNameShortYear | Date::NameDay => 1,
            Date::ShortYearMonthDay | Date::YearDay => 2,
            Date::DayMonthShortYear | Date::MonthDayShortYear | Date::MonthDay => 3,
            Date::DayMonth => 4,
            Date::None => 5,
        };
        let of_clock = match clock {
            Clock::Seconds | Clock::Minutes => 0,
            Clock::Hours if of_date >= 2 => 4,
            Clock::Hours => 2,
            // A day of no year is as weak as a time of no day.
            Clock::None if of_date >= 3 => 3,
            Clock::None => 1,
        };
        of_date + of_clock + u32::from(is_time_first) + u32::from(skip > 0) + u32::from(skip > 1)
    }

    /// Whether the number at which it begins, if it is the same in all names, may be that of a label: one or two digits behind a
    /// word, where no year in full tells them from one.
    fn label(self, name: &Name<'_>, first: usize) -> Option<Label> {
        let (word, digits) = name.groups.get(first)?;
        let has_no_year = matches!(
            self.date(),
            Some(
                Date::ShortYearMonthDay
                    | Date::DayMonthShortYear
                    | Date::MonthDayShortYear
                    | Date::MonthDay
                    | Date::DayMonth
                    | Date::None
            )
        );
        let part = word.rsplit(['/', '\\']).next().unwrap_or(word);
        let may_be =
            has_no_year && digits.len() <= 2 && part.contains(char::is_alphabetic) && !may_separate(part);
        let is_folder = name.word_after(first).starts_with(['/', '\\']);
        let is_plain = is_folder || part.ends_with(char::is_alphabetic);
        may_be.then_some(if is_plain { Label::Plain } else { Label::Possible })
    }

    const fn date(self) -> Option<Date> {
        match self {
            Self::Unix { .. } => None,
            Self::Calendar { date, .. } => Some(date),
        }
    }

    fn words(self) -> String {
        let Self::Calendar { date, clock, .. } = self else { return "Unix time".to_owned() };
        let date = match date {
            Date::YearMonthDay | Date::YearNameDay => "year-month-day",
            Date::DayNameYear | Date::DayMonthYear => "day-month-year",
            Date::NameDayYear | Date::MonthDayYear => "month-day-year",
            Date::ShortYearMonthDay => "year-month-day with two digits each",
            Date::DayNameShortYear | Date::DayMonthShortYear => "day-month-year with two digits each",
            Date::MonthDayShortYear => "month-day-year with two digits each",
            Date::YearDay => "year and day of the year",
            Date::NameDay | Date::MonthDay => "month-day",
            Date::DayMonth => "day-month",
            Date::None => "the time of day alone",
        };
        let clock = match clock {
            Clock::Seconds => " to the second",
            Clock::Minutes => " to the minute",
            Clock::Hours => " to the hour",
            Clock::None => "",
        };
        format!("{date}{clock}")
    }

    /// The resolution in seconds.
    const fn resolution_s(self) -> f64 {
        match self {
            Self::Unix { .. } | Self::Calendar { clock: Clock::Seconds, .. } => 1.0,
            Self::Calendar { clock: Clock::Minutes, .. } => 60.0,
            Self::Calendar { clock: Clock::Hours, .. } => HOUR_S,
            Self::Calendar { clock: Clock::None, .. } => DAY_S,
        }
    }

    /// Reads a name from its number `first` on.
    fn read(self, name: &Name<'_>, first: usize) -> Option<Moment> {
        let mut cursor = Cursor { name, group: first, offset: 0, is_new: true };
        match self {
            Self::Unix { digits } => {
                let (_, group) = name.groups.get(first)?;
                let seconds = group.parse::<f64>().ok()? / [1.0, 1e3, 1e6][(digits - 10) / 3];
                // 2010 to 2034: no date of month, day, hour, minute and second is so large a number.
                let is_time = group.len() == digits && (1_262_304_000.0..2_051_222_400.0).contains(&seconds);
                is_time.then_some(Moment { seconds, offset_s: None, first, last: first })
            }
            Self::Calendar { date, clock, is_time_first: true, .. } => {
                let of_day = cursor.clock(clock)?;
                let fraction = cursor.fraction_s(date, clock)?;
                let days = cursor.date(date)?;
                cursor.is_at_end().then_some(())?;
                Some(Moment { seconds: days + of_day + fraction, offset_s: None, first, last: cursor.group })
            }
            Self::Calendar { date, clock, skip, .. } => {
                let days = cursor.date(date)?;
                if clock == Clock::None {
                    cursor.is_at_end().then_some(())?;
                    return Some(Moment { seconds: days, offset_s: None, first, last: cursor.group });
                }
                if skip > 0 {
                    cursor.is_at_end().then_some(())?;
                    cursor.group += skip;
                    cursor.offset = name.groups.get(cursor.group)?.1.len();
                }
                let of_day = cursor.clock(clock)?;
                // Without a date, a folder's number is no hour, and neither is a part of a longer number.
                let is_torn = |at: usize| {
                    let (word, digits) = name.groups[at];
                    word.contains(['/', '\\']) || digits.len() > 2 || name.groups[at - 1].1.len() > 2
                };
                if date == Date::None && (first + 1..=cursor.group).any(is_torn) {
                    return None;
                }
                let fraction = cursor.fraction_s(date, clock)?;
                let offset_s = if clock == Clock::Hours { None } else { cursor.offset_s() };
                Some(Moment { seconds: days + of_day + fraction, offset_s, first, last: cursor.group })
            }
        }
    }
}

/// Whether a number is that of a label.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Label {
    /// It is, as in `cam1` or the folder `plant-2`.
    Plain,
    /// It may be, as in `plant 12 05-03`, or a month, as in `IMG_05-03`.
    Possible,
}

/// What one name says.
#[derive(Clone, Copy)]
struct Moment {
    seconds: f64,
    /// Seconds by which the clock is ahead of UTC, and whether it follows a plus.
    offset_s: Option<(f64, bool)>,
    /// The first and the last number that is read.
    first: usize,
    last: usize,
}

/// The beginnings of the names of months, and the names in Dutch, French, German, Italian, Portuguese and Spanish that begin
/// otherwise, without accents.
const MONTHS: [(&str, &[&str]); 12] = [
    ("jan", &["ene", "enero", "gen", "gennaio"]),
    ("feb", &["fev", "fevr", "fevrier", "fevereiro"]),
    ("mar", &["maart", "maerz", "mrt", "mrz"]),
    ("apr", &["abr", "abril", "avr", "avril"]),
    ("may", &["mag", "maggio", "mai", "maio", "mei"]),
    ("jun", &["giu", "giugno", "juin"]),
    ("jul", &["juil", "juillet", "lug", "luglio"]),
    ("aug", &["ago", "agosto", "aout"]),
    ("sep", &["set", "setembro", "settembre"]),
    ("oct", &["okt", "oktober", "ott", "ottobre", "out", "outubro"]),
    ("nov", &[]),
    ("dec", &["dez", "dezember", "dezembro", "dic", "dicembre", "diciembre"]),
];

/// The month that a word names, from 1.
fn month_in(word: &str) -> Option<u32> {
    let plain: String = word.to_lowercase().chars().filter_map(without_accent).collect();
    let parts: Vec<&str> = plain.split(|letter: char| !letter.is_alphabetic()).collect();
    let is_named = |(start, others): &(&str, &[&str])| {
        parts.iter().any(|part| part.starts_with(start) || others.contains(part))
    };
    Some(MONTHS.iter().position(is_named)? as u32 + 1)
}

/// A letter without the accent that months have, written together or apart; `None` for the accent alone.
fn without_accent(letter: char) -> Option<char> {
    match letter {
        'ä' => Some('a'),
        'é' | 'è' => Some('e'),
        'û' => Some('u'),
        'ç' => Some('c'),
        '\u{300}'..='\u{36f}' => None,
        other => Some(other),
    }
}

/// Names of time zones, and the hours by which their clocks are ahead of UTC.
const ZONES: [(&str, f64); 17] = [
    ("utc", 0.0),
    ("gmt", 0.0),
    ("bst", 1.0),
    ("wet", 0.0),
    ("west", 1.0),
    ("cet", 1.0),
    ("cest", 2.0),
    ("mez", 1.0),
    ("mesz", 2.0),
    ("est", -5.0),
    ("edt", -4.0),
    ("cst", -6.0),
    ("cdt", -5.0),
    ("mst", -7.0),
    ("mdt", -6.0),
    ("pst", -8.0),
    ("pdt", -7.0),
];

/// Takes fields from the numbers of a name.
struct Cursor<'a> {
    name: &'a Name<'a>,
    group: usize,
    /// Digits of the group that are taken.
    offset: usize,
    /// Whether no field was taken: what stands before the first says nothing.
    is_new: bool,
}

impl Cursor<'_> {
    fn is_at_end(&self) -> bool {
        self.name.groups.get(self.group).is_none_or(|(_, digits)| self.offset == digits.len())
    }

    /// The next field of so many digits. A number of one digit is a field of two.
    fn take(&mut self, width: usize) -> Option<u32> {
        if !self.is_new && self.is_at_end() {
            self.group += 1;
            self.offset = 0;
        }
        let (word, digits) = self.name.groups.get(self.group)?;
        if self.offset == 0 && !self.is_new && !may_separate(word) {
            return None;
        }
        self.is_new = false;
        let width = if self.offset == 0 && digits.len() == 1 && width == 2 { 1 } else { width };
        let field = digits.get(self.offset..self.offset + width)?;
        self.offset += width;
        field.parse().ok()
    }

    /// The month whose name stands in the word before the next number.
    fn month(&self) -> Option<u32> {
        let next = if self.is_new { self.group } else { self.group + 1 };
        month_in(self.name.groups.get(next)?.0)
    }

    /// Seconds from 1970 to the start of a date.
    fn date(&mut self, date: Date) -> Option<f64> {
        // A leap year, in which all days exist.
        const ANY_YEAR: u32 = 1972;
        let short = |year: u32| 2_000 + year;
        let first = if !self.is_new && self.is_at_end() { self.group + 1 } else { self.group };
        let (year, month, day) = match date {
            Date::YearMonthDay => (self.take(4)?, self.take(2)?, self.take(2)?),
            Date::YearNameDay => (self.take(4)?, self.month()?, self.take(2)?),
            Date::DayNameYear => {
                let (day, month) = (self.take(2)?, self.month()?);
                (self.take(4)?, month, day)
            }
            Date::NameDayYear => {
                let (month, day) = (self.month()?, self.take(2)?);
                (self.take(4)?, month, day)
            }
            Date::DayMonthYear => {
                let (day, month) = (self.take(2)?, self.take(2)?);
                (self.take(4)?, month, day)
            }
            Date::MonthDayYear => {
                let (month, day) = (self.take(2)?, self.take(2)?);
                (self.take(4)?, month, day)
            }
            Date::DayNameShortYear => {
                let (day, month) = (self.take(2)?, self.month()?);
                (short(self.take(2)?), month, day)
            }
            Date::ShortYearMonthDay => (short(self.take(2)?), self.take(2)?, self.take(2)?),
            Date::DayMonthShortYear => {
                let (day, month) = (self.take(2)?, self.take(2)?);
                (short(self.take(2)?), month, day)
            }
            Date::MonthDayShortYear => {
                let (month, day) = (self.take(2)?, self.take(2)?);
                (short(self.take(2)?), month, day)
            }
            Date::YearDay => {
                let (year, day) = (self.take(4)?, self.take(3)?);
                let start = unix_seconds(year, [1, 1, 0, 0, 0])?;
                return (1..=366).contains(&day).then(|| start + f64::from(day - 1) * DAY_S);
            }
            Date::NameDay => (ANY_YEAR, self.month()?, self.take(2)?),
            Date::MonthDay => (ANY_YEAR, self.take(2)?, self.take(2)?),
            Date::DayMonth => {
                let (day, month) = (self.take(2)?, self.take(2)?);
                (ANY_YEAR, month, day)
            }
            Date::None => return Some(0.0),
        };
        let is_short =
            matches!(date, Date::ShortYearMonthDay | Date::DayMonthShortYear | Date::MonthDayShortYear);
        // Six digits together, or three times two: else two numbers of different kinds.
        if is_short && !matches!(self.group - first, 0 | 2) {
            return None;
        }
        unix_seconds(year, [month, day, 0, 0, 0])
    }

    /// Seconds since midnight, by a clock of 24 hours, or of 12 with AM or PM behind.
    fn clock(&mut self, clock: Clock) -> Option<f64> {
        let hour = self.take(2)?;
        self.is_unit(&["h"]).then_some(())?;
        let place = self.group;
        let minute = if clock == Clock::Hours { 0 } else { self.take(2)? };
        (clock == Clock::Hours || self.is_unit(&["m", "min"])).then_some(())?;
        // What follows hours and minutes that are written together counts photographs.
        if clock == Clock::Seconds && self.group == place && self.is_at_end() {
            return None;
        }
        let second = if clock == Clock::Seconds { self.take(2)? } else { 0 };
        (clock != Clock::Seconds || self.is_unit(&["s", "sec"])).then_some(())?;
        let word = self.name.word_after(self.group).trim_start_matches(['_', '-', ' ', '.']).to_lowercase();
        let is_half = self.is_at_end() && (1..=12).contains(&hour);
        // Not words that begin so, such as "pm" in "pmarker".
        let is_word = |half: &str| {
            word.strip_prefix(half)
                .is_some_and(|rest| !rest.starts_with(|letter: char| letter.is_alphabetic()))
        };
        let hour = match () {
            () if is_half && is_word("pm") => hour % 12 + 12,
            () if is_half && is_word("am") => hour % 12,
            () => hour,
        };
        (hour < 24 && minute < 60 && second <= 60).then(|| f64::from(hour * 3_600 + minute * 60 + second))
    }

    /// Whether no unit of time stands behind the field but one of these.
    fn is_unit(&self, wanted: &[&str]) -> bool {
        const UNITS: [&str; 6] = ["d", "h", "m", "min", "s", "sec"];
        let word = self.name.word_after(self.group).to_lowercase();
        let unit = word.split(|letter: char| !letter.is_alphabetic()).next().unwrap_or_default();
        !self.is_at_end() || !UNITS.contains(&unit) || wanted.contains(&unit)
    }

    /// What is left of the number as a fraction of a second, of three, six or nine digits, behind a year also two; 0 where nothing
    /// is left.
    fn fraction_s(&mut self, date: Date, clock: Clock) -> Option<f64> {
        let rest = &self.name.groups.get(self.group)?.1[self.offset..];
        let has_year = matches!(date, Date::YearMonthDay | Date::ShortYearMonthDay);
        let is_fraction =
            clock == Clock::Seconds && (matches!(rest.len(), 3 | 6 | 9) || rest.len() == 2 && has_year);
        self.offset += rest.len();
        match rest {
            "" => Some(0.0),
            _ if is_fraction => format!("0.{rest}").parse().ok(),
            _ => None,
        }
    }

    /// The offset from UTC behind the time: `+0200`, `-05-00`, `+01`, `CEST`.
    fn offset_s(&self) -> Option<(f64, bool)> {
        let next = self.group + 1;
        let behind = self.name.word_after(self.group).to_lowercase();
        let zone = behind.trim_matches(|letter: char| !letter.is_alphabetic());
        if let Some((_, hours)) = ZONES.iter().find(|(name, _)| *name == zone) {
            return Some((hours * HOUR_S, true));
        }
        let &(word, digits) = self.name.groups.get(next)?;
        let is_plus = match word {
            "+" => true,
            "-" => false,
            _ => return None,
        };
        let (hours, minutes) = match digits.len() {
            4 => digits.split_at(2),
            2 => match self.name.groups.get(next + 1) {
                Some(&(":" | "-" | "_" | "", minutes)) if minutes.len() == 2 => (digits, minutes),
                _ => (digits, "00"),
            },
            _ => return None,
        };
        let (hours, minutes): (u32, u32) = (hours.parse().ok()?, minutes.parse().ok()?);
        let is_offset = hours <= 14 && minutes.is_multiple_of(15) && minutes < 60;
        let seconds = f64::from(hours * 3_600 + minutes * 60);
        is_offset.then_some((if is_plus { seconds } else { -seconds }, is_plus))
    }
}

/// Whether a word may stand between two fields: separators, a folder, or what names a field in English or another script.
fn may_separate(word: &str) -> bool {
    let letters: String = word.chars().filter(char::is_ascii_alphabetic).collect::<String>().to_lowercase();
    let is_field = matches!(letters.as_str(), "" | "t" | "at" | "y" | "m" | "d" | "h" | "min" | "uhr")
        || month_in(word).is_some();
    // Words are longer where a month has prepositions about it.
    word.chars().count() <= 20 && is_field || word.chars().count() <= 12 && word.contains(['/', '\\'])
}

/// One reading of a series.
struct Reading {
    form: Form,
    /// Whether its first number may be that of a label.
    is_labelled: bool,
    times: Vec<Option<f64>>,
    /// Whether the same numbers are read in each name; else they are found anew in each.
    is_fixed: bool,
    /// The first and the last number that is read in any name.
    span: (usize, usize),
    /// Share of the intervals that are the median one.
    even: f64,
    /// Median intervals from the first photograph to the last, by photographs: many where a reading tears neighbours apart.
    spread: u64,
}

/// Names on which a form is tried before all are read. Chosen by hand.
const TRIED: usize = 40;

/// All readings of a series that give most names a time, and most of them different ones.
fn readings_of(names: &[Name<'_>], alike: &[usize]) -> Vec<Reading> {
    let stride = names.len().div_ceil(TRIED).max(1);
    let tried: Vec<&Name<'_>> = names.iter().step_by(stride).collect();
    let most = tried.iter().map(|name| name.groups.len()).max().unwrap_or(0).min(16);
    let constant: Vec<bool> = (0..most)
        .map(|at| {
            let group = |name: &Name<'_>| name.groups.get(at).map(|(_, digits)| (*digits).to_owned());
            let first = names.first().and_then(group);
            names.iter().all(|name| group(name) == first)
        })
        .collect();
    let mut readings: Vec<Reading> = Vec::new();
    for form in Form::all() {
        let read = |name: &Name<'_>, first: Option<usize>| match first {
            Some(first) => form.read(name, first),
            None => (0..name.groups.len()).find_map(|first| form.read(name, first)),
        };
        let starts = (0..most).map(Some).chain((form.rank() == 0).then_some(None));
        for first in starts {
            let count = tried.iter().filter(|name| read(name, first).is_some()).count();
            if 2 * count <= tried.len() {
                continue;
            }
            let moments: Vec<Option<Moment>> = names.iter().map(|name| read(name, first)).collect();
            if let (Form::Calendar { skip: 1.., .. }, Some(first)) = (form, first) {
                // What is skipped must say nothing: some number between date and time that never changes, or counts.
                let last = moments.iter().flatten().map(|moment| moment.last).max().unwrap_or(first);
                let counts =
                    |at: usize| counts_up(names, alike, at).is_some_and(|share| share > LEAST_COUNTED);
                if !(first.min(most)..last.min(most)).any(|at| constant[at] || counts(at)) {
                    continue;
                }
            }
            let times = with_offsets(&moments);
            let is_counter = |reading: &Reading| {
                let last = reading.possible_counter(names, alike);
                let Some(share) = last.and_then(|last| counts_up(names, alike, last)) else { return false };
                // A clock never shows what is no time.
                let is_ruled_out =
                    share >= LEAST_COUNTED && alike.iter().any(|&index| reading.times[index].is_none());
                is_ruled_out || reading.rank() >= 5 && share >= reading.even
            };
            // Digits that never reach ten count photographs within an hour or a minute.
            let last = moments.iter().flatten().map(|moment| moment.last).max().unwrap_or(0);
            let mut lasts = alike.iter().filter_map(|&index| names[index].groups.get(last));
            if matches!(form, Form::Calendar { clock: Clock::Seconds | Clock::Minutes, .. })
                && lasts.all(|(_, digits)| digits.len() == 1)
                && !constant.get(last).is_some_and(|is_constant| *is_constant)
            {
                continue;
            }
            let label = first.filter(|first| constant[*first]).and_then(|first| form.label(&names[0], first));
            if label == Some(Label::Plain) {
                continue;
            }
            let is_labelled = label.is_some();
            if let Some(reading) = Reading::new(form, is_labelled, first, times, &moments)
                && !is_counter(&reading)
                && readings
                    .iter()
                    .all(|other| !are_the_same(&other.times, &reading.times) || other.rank() > form.rank())
            {
                readings.push(reading);
            }
        }
    }
    drop_weaker(&mut readings, names, alike);
    readings
}

/// Least share of rises by one of a counter.
const LEAST_COUNTED: f64 = 0.8;

/// Drops readings that another one makes unlikely.
fn drop_weaker(readings: &mut Vec<Reading>, names: &[Name<'_>], alike: &[usize]) {
    // One that leaves out names which another reads has met them by chance.
    let count = |reading: &Reading| reading.times.iter().flatten().count();
    let most = readings.iter().map(count).max().unwrap_or(0);
    readings.retain(|reading| reading.rank() == 0 || count(reading) == most);
    // A counter between date and time, as in `2024-10-12/DSC_0042_090000.jpg`, is no time.
    let is_counter = |reading: &Reading, others: &[Reading]| {
        let Form::Calendar { date, skip: 0, .. } = reading.form else { return false };
        let Some((first, last)) = reading.used().filter(|(first, last)| first < last) else { return false };
        let goes_on = |other: &Reading| {
            matches!(other.form, Form::Calendar { date: also, skip: 1.., .. } if also == date)
                && other.used().is_some_and(|used| used.0 == first && used.1 > last)
        };
        reading.possible_counter(names, alike).is_some()
            && counts_up(names, alike, last).is_some_and(|share| share >= reading.even)
            && others.iter().any(goes_on)
    };
    // A part of the digits that another one reads, which is about as even and no less usual.
    let is_part = |reading: &Reading, others: &[Reading]| {
        let Some((first, last)) = reading.used() else { return false };
        others.iter().any(|other| {
            other.used().is_some_and(|used| used.0 <= first && last <= used.1 && used != (first, last))
                && other.rank() <= reading.rank()
                && other.form.resolution_s() <= reading.form.resolution_s()
                && other.even >= reading.even - PART_MARGIN
        })
    };
    let is_kept: Vec<bool> = readings
        .iter()
        .map(|reading| !is_counter(reading, readings) && !is_part(reading, readings))
        .collect();
    let mut is_kept = is_kept.into_iter();
    readings.retain(|_| is_kept.next().unwrap_or(true));
}

/// Longest median interval of a reading, in seconds. Chosen: hours that are taken for years come out as even.
const MAX_INTERVAL_S: f64 = 40.0 * DAY_S;

/// Times in UTC, if what follows them are offsets: a few different ones, not a counter.
fn with_offsets(moments: &[Option<Moment>]) -> Vec<Option<f64>> {
    let mut offsets: Vec<(i64, bool)> = moments
        .iter()
        .flatten()
        .filter_map(|moment| moment.offset_s)
        .map(|(s, is_plus)| (s as i64, is_plus))
        .collect();
    let count = offsets.len();
    offsets.sort_unstable();
    offsets.dedup();
    let have_all = 10 * count >= 9 * moments.iter().flatten().count();
    let are_offsets =
        have_all && (offsets.iter().all(|(_, is_plus)| *is_plus) || offsets.len() <= 3 && count > 4);
    let time = |moment: &Moment| {
        moment.seconds - moment.offset_s.filter(|_| are_offsets).map_or(0.0, |(offset, _)| offset)
    };
    moments.iter().map(|moment| moment.as_ref().map(time)).collect()
}

impl Reading {
    /// `None` if less than half of the times differ.
    fn new(
        form: Form,
        is_labelled: bool,
        first: Option<usize>,
        mut times: Vec<Option<f64>>,
        moments: &[Option<Moment>],
    ) -> Option<Self> {
        if let Form::Calendar { date: Date::None, .. } = form {
            over_midnight(&mut times);
        }
        if let Form::Calendar { date: Date::NameDay | Date::MonthDay | Date::DayMonth, .. } = form {
            cut_cycle(&mut times, 366.0 * DAY_S);
        }
        let known = known_times(&times);
        if 2 * known.len() <= times.len() || known.len() < 2 {
            return None;
        }
        let even = even_share(&known, form.resolution_s());
        if median_interval(&known)? > MAX_INTERVAL_S {
            return None;
        }
        let spread = (known[known.len() - 1] - known[0]) / median_interval(&known)? / known.len() as f64;
        let spread = spread as u64;
        let start = moments.iter().flatten().map(|moment| moment.first).min()?;
        let last = moments.iter().flatten().map(|moment| moment.last).max()?;
        Some(Self { form, is_labelled, times, is_fixed: first.is_some(), span: (start, last), even, spread })
    }

    /// How unusual it is, from 0.
    fn rank(&self) -> u32 {
        self.form.rank() + u32::from(self.is_labelled)
    }

    /// The first and the last number that is read; `None` where they are found anew in each name.
    fn used(&self) -> Option<(usize, usize)> {
        self.is_fixed.then_some(self.span)
    }

    /// The place of the last number that is read, if it may be a counter: it holds the whole clock, and no date before it. Fields
    /// of a clock that stand apart are no counter, however the last of them rises.
    fn possible_counter(&self, names: &[Name<'_>], alike: &[usize]) -> Option<usize> {
        let Form::Calendar { clock, .. } = self.form else { return None };
        let (first, last) = self.span;
        let digits = names[*alike.first()?].groups.get(last)?.1;
        let has_whole_clock = matches!(clock, Clock::Hours | Clock::None) || digits.len() >= 4;
        let has_date = first == last && self.rank() < 5;
        (has_whole_clock && !has_date).then_some(last)
    }

    /// The first number of a counter that this reading may be: its last number rises by one as evenly as its times do.
    fn first_of_counter(&self, names: &[Name<'_>], alike: &[usize]) -> Option<u64> {
        let last = self.possible_counter(names, alike)?;
        let is_counter = counts_up(names, alike, last)? >= self.even.max(LEAST_COUNTED);
        is_counter
            .then(|| alike.iter().filter_map(|&index| names[index].groups[last].1.parse().ok()).min())?
    }

    /// Looks for what a clock does: an hour back or on, a new date, an old one.
    fn check_clock(&self, names: &[Name<'_>], alike: &[usize], found: &mut NameTimes) {
        let known = known_times(&found.times);
        let Some(usual) = median_interval(&known) else { return };
        let has_skipped = matches!(self.form, Form::Calendar { skip: 1.., .. });
        let numbers = self.used().and_then(|used| counter_beside(names, alike, used, has_skipped));
        if let Some(numbers) = numbers {
            in_order_of_numbers(&numbers, usual, self.form.resolution_s(), found);
        }
        found.warnings.extend(jump_of_clock(&found.times));
        if matches!(self.form, Form::Calendar { date: Date::None, .. }) && self.even < LEAST_EVEN_OF_DAY {
            found.warnings.push(
                "the names tell the time of day alone, and the intervals differ: photographs of several days may be mixed"
                    .to_owned(),
            );
        }
        if let Some(warning) = self.midnight(names, usual) {
            found.warnings.push(warning);
        }
        found.warnings.extend(self.half_days(names));
    }

    /// Whether one date stands for two days: the first photographs of the day and the last ones.
    fn midnight(&self, names: &[Name<'_>], usual: f64) -> Option<String> {
        let days: Vec<f64> = self.times.iter().flatten().map(|time| (time / DAY_S).floor()).collect();
        let is_one_day = days.iter().all(|day| *day == days[0]);
        if !is_one_day || names.len() < 4 || matches!(self.form, Form::Unix { .. }) {
            return None;
        }
        let known = known_times(&self.times);
        let gap = known.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let around = known[0] + DAY_S - known[known.len() - 1];
        (around <= 1.5 * usual && gap > (2.0 * HOUR_S).max(3.0 * usual)).then(|| {
            "the photographs of one date end and begin at midnight, with a gap between them: the first ones may be of the day \
             after"
                .to_owned()
        })
    }

    /// Whether the clock may be one of twelve hours without AM and PM.
    fn half_days(&self, names: &[Name<'_>]) -> Option<String> {
        let Form::Calendar { clock: Clock::Seconds | Clock::Minutes, .. } = self.form else { return None };
        let known = known_times(&self.times);
        let hours: Vec<f64> =
            self.times.iter().flatten().map(|time| (time % DAY_S / HOUR_S).floor()).collect();
        let span = known[known.len() - 1] - known[0];
        // A camera that works by day only takes no photograph before one o'clock either, but some in the afternoon.
        let is_half = hours.iter().all(|hour| (1.0..13.0).contains(hour))
            && hours.contains(&12.0)
            && hours.contains(&1.0);
        (is_half && span > 11.0 * HOUR_S && names.len() > 12).then(|| {
            "the hours in the names are 1 to 12 on all days: a clock of twelve hours without AM and PM cannot be read".to_owned()
        })
    }
}

/// The known times, each once, in order.
#[must_use]
pub fn known_times(times: &[Option<f64>]) -> Vec<f64> {
    let mut known: Vec<f64> = times.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    known.dedup();
    known
}

/// The median interval between successive [`known_times`]; `None` of fewer than two.
#[must_use]
pub fn median_interval(known: &[f64]) -> Option<f64> {
    let intervals: Vec<f64> = known.windows(2).map(|pair| pair[1] - pair[0]).collect();
    (!intervals.is_empty()).then(|| median(&intervals))
}

/// Share of the intervals that are the median one, to a tenth of it or to the resolution.
fn even_share(known: &[f64], resolution_s: f64) -> f64 {
    let Some(usual) = median_interval(known) else { return 0.0 };
    let margin = (0.1 * usual).max(resolution_s.min(0.5 * usual));
    let even = known.windows(2).filter(|pair| (pair[1] - pair[0] - usual).abs() <= margin).count();
    even as f64 / (known.len() - 1) as f64
}

/// Whether two readings differ by the same everywhere.
fn are_the_same(one: &[Option<f64>], other: &[Option<f64>]) -> bool {
    let mut differences = one.iter().zip(other).filter_map(|(one, other)| Some((*one)? - (*other)?));
    let Some(first) = differences.next() else { return false };
    let has_same_names = one.iter().zip(other).all(|(one, other)| one.is_some() || other.is_none());
    has_same_names && differences.all(|difference| (difference - first).abs() < 1.0)
}

/// Times of day in the order of names: a day more each time that the clock goes back, or half a day where that is more even, as
/// on a clock of twelve hours. Where it never goes back, the largest gap is cut, so that a night is whole.
fn over_midnight(times: &mut Vec<Option<f64>>) {
    let unwrapped = |cycle: f64| -> Vec<Option<f64>> {
        let (mut before, mut cycles) = (f64::NEG_INFINITY, 0.0);
        times
            .iter()
            .map(|time| {
                let time = (*time)? % cycle;
                if time < before {
                    cycles += cycle;
                }
                before = time;
                Some(time + cycles)
            })
            .collect()
    };
    let is_half = times.iter().flatten().all(|time| (HOUR_S..13.0 * HOUR_S).contains(time));
    let day = unwrapped(DAY_S);
    let even = |times: &[Option<f64>]| even_share(&known_times(times), 1.0);
    *times = match is_half.then(|| unwrapped(0.5 * DAY_S)) {
        Some(half) if even(&half) > even(&day) => half,
        _ => day,
    };
    cut_cycle(times, DAY_S);
}

/// Moves what lies before the largest gap behind the rest, where the ends of a cycle meet.
fn cut_cycle(times: &mut [Option<f64>], cycle: f64) {
    let known = known_times(times);
    let Some(usual) = median_interval(&known) else { return };
    let around = known[0] + cycle - known[known.len() - 1];
    let Some(gap) = known.windows(2).max_by(|one, other| (one[1] - one[0]).total_cmp(&(other[1] - other[0])))
    else {
        return;
    };
    if (0.0..=2.0 * usual).contains(&around) && gap[1] - gap[0] > 3.0 * usual {
        times.iter_mut().flatten().filter(|time| **time <= gap[0]).for_each(|time| *time += cycle);
    }
}

/// How much the only number that differs rises most often from name to name of those that are `alike`, and in what share of them.
fn rise_of_counter(names: &[Name<'_>], alike: &[usize]) -> Option<(u64, f64)> {
    let first = &names[*alike.first()?];
    let digits = |name: &Name<'_>, at: usize| name.groups.get(at).map(|(_, digits)| (*digits).to_owned());
    let differs = |at: &usize| alike.iter().any(|&index| digits(&names[index], *at) != digits(first, *at));
    let mut varying = (0..first.groups.len()).filter(differs);
    let (Some(at), None) = (varying.next(), varying.next()) else { return None };
    usual_rise(names, alike, at)
}

/// How much the number at this place rises most often from name to name of those that are `alike`, and in what share of them.
fn usual_rise(names: &[Name<'_>], alike: &[usize], at: usize) -> Option<(u64, f64)> {
    let number = |&index: &usize| names[index].groups.get(at)?.1.parse().ok();
    let numbers: Vec<u64> = alike.iter().map(number).collect::<Option<_>>()?;
    let mut counts = BTreeMap::new();
    let rises = numbers.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
    rises.for_each(|rise| *counts.entry(rise).or_insert(0_usize) += 1);
    let (rise, count) = counts.into_iter().rev().max_by_key(|(_, count)| *count)?;
    Some((rise, count as f64 / (numbers.len() - 1) as f64))
}

/// In what share of the names that are `alike` the number at this place is one more than in the name before, if that is its usual
/// rise.
fn counts_up(names: &[Name<'_>], alike: &[usize], at: usize) -> Option<f64> {
    usual_rise(names, alike, at).and_then(|(rise, share)| (rise == 1).then_some(share))
}

/// The numbers of a counter that stands beside the time, of which each occurs once.
fn counter_beside(
    names: &[Name<'_>],
    alike: &[usize],
    used: (usize, usize),
    has_skipped: bool,
) -> Option<Vec<u64>> {
    let least = names.iter().map(|name| name.groups.len()).min()?;
    let is_skipped =
        |at: usize| has_skipped && counts_up(names, alike, at).is_some_and(|share| share > LEAST_COUNTED);
    let candidates = (0..least).rev().filter(|at| !(used.0..=used.1).contains(at) || is_skipped(*at));
    candidates.into_iter().find_map(|at| {
        let numbers: Vec<u64> =
            names.iter().map(|name| name.groups[at].1.parse().ok()).collect::<Option<_>>()?;
        let mut sorted = numbers.clone();
        sorted.sort_unstable();
        sorted.dedup();
        let is_counter =
            sorted.len() == numbers.len() && sorted[sorted.len() - 1] - sorted[0] <= 4 * numbers.len() as u64;
        is_counter.then_some(numbers)
    })
}

/// Compares the order of times with that of the numbers, and undoes the end and the start of summer time.
fn in_order_of_numbers(numbers: &[u64], usual: f64, resolution_s: f64, found: &mut NameTimes) {
    let mut order: Vec<usize> = (0..numbers.len()).filter(|&index| found.times[index].is_some()).collect();
    order.sort_by_key(|&index| numbers[index]);
    let margin = (0.2 * usual).max(2.0 * resolution_s);
    let mut shift = 0.0;
    let mut corrected = found.times.clone();
    let (mut is_broken, mut is_half) = (false, false);
    for pair in order.windows(2) {
        let (Some(before), Some(time)) = (found.times[pair[0]], found.times[pair[1]]) else { continue };
        let interval = time - before;
        let next = (numbers[pair[1]] - numbers[pair[0]]) as f64;
        if interval < 0.0 && (interval + HOUR_S - next * usual).abs() <= margin {
            shift += HOUR_S;
            found.notes.push(
                "the clock goes back by an hour once, as at the end of summer time: an hour is added after"
                    .to_owned(),
            );
        } else if usual < 0.5 * HOUR_S && (interval - HOUR_S - next * usual).abs() <= margin {
            shift -= HOUR_S;
            found.notes.push("the clock goes on by an hour once, as at the start of summer time: an hour is taken off after".to_owned());
        } else if interval < 0.0 && (interval + DAY_S - next * usual).abs() <= margin {
            shift += DAY_S;
            found.notes.push("the times go on after midnight under the same date: a day is added".to_owned());
        } else if interval < -resolution_s {
            is_broken = true;
        } else if next == 1.0 && (interval - 0.5 * DAY_S - usual).abs() <= margin {
            is_half = true;
        }
        corrected[pair[1]] = Some(time + shift);
    }
    found.notes.dedup();
    if is_half {
        found.warnings.push(
            "between two photographs that are numbered one after the other the clock goes on by twelve hours: it may be one of \
             twelve hours without AM and PM"
                .to_owned(),
        );
    }
    if is_broken {
        found.warnings.push(
            "the times in the names and the numbers in them give different orders: the clock was set, or the numbers count \
             something else"
                .to_owned(),
        );
    } else {
        found.times = corrected;
    }
}

/// A gap that is longer than three times all others together, and than a day: the clock was set then.
#[must_use]
pub fn jump_of_clock(times: &[Option<f64>]) -> Option<String> {
    let known = known_times(times);
    if known.len() < 3 {
        return None;
    }
    let gaps = known.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = gaps.fold(0.0, f64::max);
    let rest = known[known.len() - 1] - known[0] - longest;
    (longest > DAY_S && longest > 3.0 * rest).then(|| {
        format!(
            "there is a gap of {:.0} days between photographs that otherwise span {:.1} hours: the camera's clock may have been \
             set meanwhile; leave out those with the wrong date, or copy the series under new names",
            longest / DAY_S,
            rest / HOUR_S
        )
    })
}

#[cfg(test)]
mod tests;
