//! A stroke font for text in pictures: letters as lines, sharp at any size, without a font file.
//!
//! The letters are those of A. V. Hershey, Calligraphy for Computers, U.S. Naval Weapons Laboratory 1967 (simplex sans serif),
//! in the notation of J. Hurt: pairs of characters whose distance from `R` is x to the right and y down. The first pair is the
//! left and the right edge of the letter; ` R` lifts the pen.

use tiny_skia::PathBuilder;

/// The row of the upper edge of capitals and digits, and their height, in the font's units.
const CAP_LINE: f32 = -12.0;
const CAP_HEIGHT: f32 = 21.0;

/// Width of a letter in shares of Hershey's, whose letters are wide; chosen by hand.
const CONDENSED: f32 = 0.82;

/// Letters from the space (U+0020) to the tilde (U+007E).
const ASCII: [&str; 95] = [
    "JZ",
    "MWRFRT RRYQZR[SZRY",
    "JZNFNM RVFVM",
    "H]SBLb RYBRb RLOZO RKUYU",
    "H\\PBP_ RTBT_ RYIWGTFPFMGKIKKLMMNOOUQWRXSYUYXWZT[P[MZKX",
    "F^[FI[ RNFPHPJOLMMKMIKIIJGLFNFPGSHVHYG[F RWTUUTWTYV[X[ZZ[X[VYTWT",
    "E_\\O\\N[MZMYNXPVUTXRZP[L[JZIYHWHUISJRQNRMSKSIRGPFNGMIMKNNPQUXWZY[[[\\Z\\Y",
    "MWRHQGRFSGSIRKQL",
    "KYVBTDRGPKOPOTPYR]T`Vb",
    "KYNBPDRGTKUPUTTYR]P`Nb",
    "JZRLRX RMOWU RWOMU",
    "H\\RLRX RLRXR",
    "NVSWRXQWRVSWSYQ[",
    "H\\LRXR",
    "NVRVQWRXSWRV",
    "G][BIb",
    "H\\QFNGLJKOKRLWNZQ[S[VZXWYRYOXJVGSFQF",
    "H\\NJPISFS[",
    "H\\LKLJMHNGPFTFVGWHXJXLWNUQK[Y[",
    "H\\MFXFRNUNWOXPYSYUXXVZS[P[MZLYKW",
    "H\\UFKTZT RUFU[",
    "H\\WFMFLOMNPMSMVNXPYSYUXXVZS[P[MZLYKW",
    "H\\XIWGTFRFOGMJLOLTMXOZR[S[VZXXYUYTXQVOSNRNOOMQLT",
    "H\\YFO[ RKFYF",
    "H\\PFMGLILKMMONSOVPXRYTYWXYWZT[P[MZLYKWKTLRNPQOUNWMXKXIWGTFPF",
    "H\\XMWPURRSQSNRLPKMKLLINGQFRFUGWIXMXRWWUZR[P[MZLX",
    "NVROQPRQSPRO RRVQWRXSWRV",
    "NVROQPRQSPRO RSWRXQWRVSWSYQ[",
    "F^ZIJRZ[",
    "E_IO[O RIU[U",
    "F^JIZRJ[",
    "I[LKLJMHNGPFTFVGWHXJXLWNVORQRT RRYQZR[SZRY",
    "E`WNVLTKQKOLNMMPMSNUPVSVUUVS RQKOMNPNSOUPV RWKVSVUXVZV\\T]Q]O\\L[JYHWGTFQFNGLHJJILHOHRIUJWLYNZQ[T[WZYYZX RXKWSWUXV",
    "I[RFJ[ RRFZ[ RMTWT",
    "G\\KFK[ RKFTFWGXHYJYLXNWOTP RKPTPWQXRYTYWXYWZT[K[",
    "H]ZKYIWGUFQFOGMILKKNKSLVMXOZQ[U[WZYXZV",
    "G\\KFK[ RKFRFUGWIXKYNYSXVWXUZR[K[",
    "H[LFL[ RLFYF RLPTP RL[Y[",
    "HZLFL[ RLFYF RLPTP",
    "H]ZKYIWGUFQFOGMILKKNKSLVMXOZQ[U[WZYXZVZS RUSZS",
    "G]KFK[ RYFY[ RKPYP",
    "NVRFR[",
    "JZVFVVUYTZR[P[NZMYLVLT",
    "G\\KFK[ RYFKT RPOY[",
    "HYLFL[ RL[X[",
    "F^JFJ[ RJFR[ RZFR[ RZFZ[",
    "G]KFK[ RKFY[ RYFY[",
    "G]PFNGLIKKJNJSKVLXNZP[T[VZXXYVZSZNYKXIVGTFPF",
    "G\\KFK[ RKFTFWGXHYJYMXOWPTQKQ",
    "G]PFNGLIKKJNJSKVLXNZP[T[VZXXYVZSZNYKXIVGTFPF RSWY]",
    "G\\KFK[ RKFTFWGXHYJYLXNWOTPKP RRPY[",
    "H\\YIWGTFPFMGKIKKLMMNOOUQWRXSYUYXWZT[P[MZKX",
    "JZRFR[ RKFYF",
    "G]KFKULXNZQ[S[VZXXYUYF",
    "I[JFR[ RZFR[",
    "F^HFM[ RRFM[ RRFW[ R\\FW[",
    "H\\KFY[ RYFK[",
    "I[JFRPR[ RZFRP",
    "H\\YFK[ RKFYF RK[Y[",
    "KYOBOb RPBPb ROBVB RObVb",
    "KYKFY^",
    "KYTBTb RUBUb RNBUB RNbUb",
    "JZRDJR RRDZR",
    "I[Ib[b",
    "NVSKQMQORPSORNQO",
    "I\\XMX[ RXPVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "H[LFL[ RLPNNPMSMUNWPXSXUWXUZS[P[NZLX",
    "I[XPVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "I\\XFX[ RXPVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "I[LSXSXQWOVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "MYWFUFSGRJR[ ROMVM",
    "I\\XMX]W`VaTbQbOa RXPVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "I\\MFM[ RMQPNRMUMWNXQX[",
    "NVQFRGSFREQF RRMR[",
    "MWRFSGTFSERF RSMS^RaPbNb",
    "IZMFM[ RWMMW RQSX[",
    "NVRFR[",
    "CaGMG[ RGQJNLMOMQNRQR[ RRQUNWMZM\\N]Q][",
    "I\\MMM[ RMQPNRMUMWNXQX[",
    "I\\QMONMPLSLUMXOZQ[T[VZXXYUYSXPVNTMQM",
    "H[LMLb RLPNNPMSMUNWPXSXUWXUZS[P[NZLX",
    "I\\XMXb RXPVNTMQMONMPLSLUMXOZQ[T[VZXX",
    "KXOMO[ ROSPPRNTMWM",
    "J[XPWNTMQMNNMPNRPSUTWUXWXXWZT[Q[NZMX",
    "MYRFRWSZU[W[ ROMVM",
    "I\\MMMWNZP[S[UZXW RXMX[",
    "JZLMR[ RXMR[",
    "G]JMN[ RRMN[ RRMV[ RZMV[",
    "J[MMX[ RXMM[",
    "JZLMR[ RXMR[P_NaLbKb",
    "J[XMM[ RMMXM RM[X[",
    "KYTBRCQDPFPHQJRKSMSOQQ RRCQEQGRISJTLTNSPORSTTVTXSZR[Q]Q_Ra RQSSUSWRYQZP\\P^Q`RaTb",
    "NVRBRb",
    "KYPBRCSDTFTHSJRKQMQOSQ RRCSESGRIQJPLPNQPURQTPVPXQZR[S]S_Ra RSSQUQWRYSZT\\T^S`RaPb",
    "F^IUISJPLONOPPTSVTXTZS[Q RISJQLPNPPQTTVUXUZT[Q[O",
];

/// Further letters of the figures.
const FURTHER: [(char, &str); 10] = [
    ('\u{2212}', "H\\LRXR"),
    ('\u{2013}', "H\\LRXR"),
    ('\u{394}', "I[RFJ[ RRFZ[ RJ[Z["),
    ('\u{2265}', "F^JIZOJU RJ[Z["),
    ('\u{2190}', "E_\\RHR RMMHRMW"),
    ('\u{2192}', "E_HR\\R RWM\\RWW"),
    ('\u{b1}', "F^RIRW RJPZP RJ[Z["),
    ('\u{b0}', "LXRFPGOIPKRLTKUITGRF"),
    ('\u{b7}', "MWRPQQRRSQRP"),
    ('\u{d7}', "G]LLXX RXLLX"),
];

/// A letter: left and right edge, and the vertices of each stroke, in the font's units.
struct Letter {
    edges: [f32; 2],
    strokes: Vec<Vec<(f32, f32)>>,
}

/// A letter of the font; `None` for one that it lacks.
fn letter(wanted: char) -> Option<Letter> {
    let further = || FURTHER.iter().find(|(letter, _)| *letter == wanted).map(|(_, notation)| *notation);
    let ascii = (wanted as usize).checked_sub(usize::from(b' ')).and_then(|index| ASCII.get(index)).copied();
    let notation = ascii.or_else(further)?;
    let unit = |byte: u8| f32::from(byte) - f32::from(b'R');
    let mut pairs = notation.as_bytes().chunks_exact(2);
    let edges = pairs.next().map_or([0.0; 2], |pair| [unit(pair[0]), unit(pair[1])]);
    let mut strokes = vec![Vec::new()];
    for pair in pairs {
        match (pair, strokes.last_mut()) {
            (b" R", _) => strokes.push(Vec::new()),
            (_, Some(stroke)) => stroke.push((unit(pair[0]), unit(pair[1]))),
            (_, None) => {}
        }
    }
    Some(Letter { edges, strokes })
}

/// The strokes of `text` in capitals `height` pixels high, with their upper left corner at `(x, y)`. A letter that the font lacks
/// is left out.
pub(super) fn strokes(text: &str, (x, y): (f32, f32), height: f32) -> Vec<Vec<(f32, f32)>> {
    let size = height / CAP_HEIGHT;
    let (mut left, mut all) = (x, Vec::new());
    for Letter { edges, strokes } in text.chars().filter_map(letter) {
        let place = |(column, row): (f32, f32)| {
            (left + (column - edges[0]) * size * CONDENSED, y + (row - CAP_LINE) * size)
        };
        all.extend(strokes.into_iter().map(|stroke| stroke.into_iter().map(place).collect()));
        left += (edges[1] - edges[0]) * size * CONDENSED;
    }
    all
}

/// The strokes of `text` as a path.
pub(super) fn path(text: &str, place: (f32, f32), height: f32) -> PathBuilder {
    let mut path = PathBuilder::new();
    for stroke in strokes(text, place, height) {
        for (index, (x, y)) in stroke.into_iter().enumerate() {
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    }
    path
}

/// The width of `text` in pixels, in capitals `height` pixels high.
pub(super) fn width(text: &str, height: f32) -> f32 {
    let widths = text.chars().filter_map(letter).map(|letter| letter.edges[1] - letter.edges[0]);
    widths.sum::<f32>() * height / CAP_HEIGHT * CONDENSED
}

/// Whether the font has all letters of `text`.
#[cfg(test)]
pub(super) fn has(text: &str) -> bool {
    text.chars().all(|wanted| letter(wanted).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_of_a_film_is_in_the_font() {
        assert!(has("VIRTUAL PLANT 0123456789 HMIN"));
        assert!(!has("\u{1f331}"));
        let drawn = |text: &str| strokes(text, (0.0, 0.0), 21.0).iter().map(Vec::len).sum::<usize>();
        assert!((33..=126_u8).all(|ascii| drawn(&char::from(ascii).to_string()) > 1));
    }

    #[test]
    fn text_is_as_wide_as_its_path() {
        let bounds = path("H1H", (10.0, 20.0), 12.0).finish().unwrap().bounds();
        assert_eq!((bounds.top(), bounds.bottom()), (20.0, 32.0));
        // Each letter has space at its sides.
        let wide = width("H1H", 12.0);
        assert!(bounds.left() > 10.0 && bounds.right() < 10.0 + wide && bounds.width() > 0.7 * wide);
        assert_eq!(width("", 12.0), 0.0);
    }
}
