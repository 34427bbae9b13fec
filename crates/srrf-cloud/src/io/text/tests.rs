//! Text as people and programs write it.

use super::*;
use crate::io::testing::{moved_copy, points_of};

fn read(text: &str) -> Result<Vec<[f64; 3]>, FormatError> {
    points_of(&Text, text.as_bytes())
}

#[test]
fn separators_titles_and_comments() {
    let expected = vec![[1.0, -2.5, 3e-3], [4.0, 5.0, 6.0]];
    for text in [
        "1 -2.5 3e-3\n4 5 6",
        "# made by hand\r\n1,-2.5,0.003,0,0,1\r\n\r\n4,5,6,1,0,0\r\n",
        "x,y,z\n1;-2.5;.003\n4\t5   6 255 0 0\n",
        "2\n1 -2.5 0.003\n4 5 6\n",
        "\u{feff}//X Y Z\n1 -2.5 0.003\n4 5 6\n",
        "1 -2.5 0.003\r4 5 6\r",
        "1,0 -2,5 0,003\n4 5 6\n",
        "x;y;z\r\n1,0;-2,5;0,003\r\n4;5;6\r\n",
        // columns by name
        "id,Z,Y,X\n7,0.003,-2.5,1\n8,6,5,4\n",
        "# id x y z\n7 1 -2.5 0.003\n8 4 5 6\n",
        "# where x y z are metres\n1 -2.5 0.003\n4 5 6\n",
    ] {
        assert_eq!(read(text).unwrap(), expected, "{text:?}");
    }
    assert!(read("nan 0 0").unwrap()[0][0].is_nan());
}

#[test]
fn bad_lines_are_numbered() {
    assert_eq!(read("1 2 3\n4 5"), Err(FormatError::line(2, "2 numbers where x, y and z are expected")));
    assert_eq!(read("#\n1 2 3\n4 five 6"), Err(FormatError::line(3, "\"five\" is not a number")));
    assert!(read("1 2 x3").is_err());
    assert!(matches!(read("3\n1 2 3\n4 5 6"), Err(FormatError::Truncated { .. })));
    assert!(read("1\n1 2 3\n4 5 6").is_err());
    assert!(read("a b c\n1 2 3").unwrap_err().to_string().contains("columns are a, b, c"));
    assert!(read("a b c\nd e f\n1 2 3").unwrap_err().to_string().contains("line 2"));
    assert!(read("1,5,2,5,3,5\n1,2,5,3,5\n").unwrap_err().to_string().contains("line 2"));
    assert!(points_of(&Text, &[0xff, 0xfe, 0x31, 0x00]).unwrap_err().to_string().contains("UTF-16"));
    assert!(points_of(&Text, &[0x31, 0x20, 0xff, 0x20, 0x32]).is_err());
    assert_eq!(read(""), Ok(vec![]));
}

#[test]
fn a_moved_copy_keeps_the_rest() {
    let motion = Rigid { translation: [1.0, 0.5, -2.0].into(), ..Rigid::identity() };
    let copy = |text: &str| {
        let mut out = Vec::new();
        moved_copy(&Text, text.as_bytes(), &motion, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    };
    assert_eq!(copy("#  a\r\n1.0, 2, 3, 255 ,0\r\n\r\n"), "#  a\r\n2, 2.5, 1, 255 ,0\r\n\r\n");
    assert_eq!(copy("1,5 2 3 0,10"), "2,5 2,5 1 0,10");
    assert_eq!(
        copy("n,x,y,z\n\"a, b\",\"1,5\",2,\"3,25\"\n\"c\nd\",,2,3\n"),
        "n,x,y,z\n\"a, b\",\"2,5\",\"2,5\",\"1,25\"\n\"c\nd\",,2,3\n"
    );
    assert_eq!(copy("x\ty\tz\n1\t\t3\n1,5\t2\t3\n"), "x\ty\tz\n1\t\t3\n2,5\t2,5\t1\n");
    assert_eq!(copy("2\nnan 0 0 red\n0 0 0 blue"), "2\nnan 0 0 red\n1 0.5 -2 blue");
}

#[test]
fn what_spreadsheets_pandas_and_cloudcompare_write() {
    let expected = vec![[1.5, -2.0, 3000.0], [4.0, 5.25, 6.0]];
    for text in [
        // Quoted words with separators, quotes and line breaks inside.
        "name,x,y,z\n\"a, b\",1.5,-2,3000\n\"say \"\"c;d\"\"\",4,5.25,6\n",
        "name,x,y,z\r\n\"two\r\nlines, and\n a third\",1.5,-2,3000\r\nb,4,5.25,6\r\n",
        "\"x [m]\";\"y\n[m]\";\"z\";\"name;more\"\n1,5;-2,0;3e3;\"a;b\"\n4;5,25;6;c\n",
        // Everything in quotes, as pandas does with QUOTE_ALL, with and without its index.
        "\"x\",\"y\",\"z\"\n\"1.5\",\"-2.0\",\"3000.0\"\n\"4.0\",\"5.25\",\"6.0\"\n",
        "\"\",\"x\",\"y\",\"z\"\n\"0\",\"1.5\",\"-2\",\"3000\"\n\"1\",\"4\",\"5.25\",\"6\"\n",
        // Decimal commas: with semicolons, tabs, and quoted between commas.
        "x;y;z\r\n1,5;-2;3000\r\n4;5,25;6\r\n",
        "x\ty\tz\tn\r\n1,5\t-2\t3000\t\r\n4\t5,25\t6\t\r\n",
        ",x,y,z\n0,\"1,5\",\"-2,0\",\"3000,0\"\n1,\"4,0\",\"5,25\",\"6,0\"\n",
        "x,y,z\n\"1,5\",-2,\"3000\"\n4,\"5,25\",6\n",
        // What Excel writes first, and rows of nothing.
        "sep=;\r\nx;y;z\r\n1,5;-2;3000\r\n4;5,25;6\r\n",
        ",,\n,,\nx,y,z\n1.5,-2,3000\n4,5.25,6\n",
        // CloudCompare.
        "//X Y Z Intensity\n2\n1.5 -2 3000 nan\n4 5.25 6 1\n",
        "//X;Y;Z;R;G;B\n1.5;-2;3000;255;0;0\n4;5.25;6;0;0;0\n",
        // Tabs, and cells of two words.
        "name\tx\ty\tz\nscan one\t1.5\t-2\t3000\nb\t4\t5.25\t6\n",
        "\"a b\" 1.5 -2 3000\n\"c\" 4 5.25 6\n",
    ] {
        let options = ReadOptions {
            columns: text.starts_with("\"a b").then(|| "2,3,4".parse().unwrap()),
            ..ReadOptions::default()
        };
        let contents =
            Text.read(text.as_bytes(), &options).map_err(|error| format!("{text:?}: {error}")).unwrap();
        assert_eq!((&contents.points, contents.notes.len()), (&expected, 0), "{text:?}");
    }
}

#[test]
fn empty_cells_are_points_that_are_not_there() {
    for (text, missing) in [
        ("x,y,z\n1,2,3\n4,,6\n7,8,9\n", 1),
        ("x,y,z\n1,2,3\n4,5,\n7,8,9\n,,\n", 2),
        ("x,y,z,name\n,2,3,a\n1,2,3,b\n7,8,9,\n", 1),
        ("x;y;z\n1;2;3\n;5;6\n7;8;9", 1),
        ("x\ty\tz\tn\n1\t2\t3\t0\n4\t\t6\t0\n7\t8\t9\t0\n", 1),
        ("1\t2\t3\t0\n4\t\t6\t0\n7\t8\t9\t0\n", 1),
        ("\t2\t3\t0\n1\t2\t3\t0\n7\t8\t9\t0\n", 1),
        ("x y z\n1 2 3\n4 \"\" 6\n7 8 9\n", 1),
        ("x,y,z\n1,2,3\nNA,5,6\n4,#N/A,6\n#VALUE!,NULL,None\n7,8,9\n", 3),
        (",x,y,z\n0,1,2,3\n1,,,\n2,7,8,9\n", 1),
        (",,\nx,y,z\n,,\n1,2,3\n7,8,9\n", 1),
    ] {
        let mut contents = Text.read(text.as_bytes(), &ReadOptions::default()).unwrap();
        assert_eq!(contents.drop_not_finite(), missing, "{text:?}");
        assert_eq!(contents.points, [[1.0, 2.0, 3.0], [7.0, 8.0, 9.0]], "{text:?}");
        assert_eq!(contents.notes, [Note::EmptyCells { rows: missing }], "{text:?}");
    }
    let one = Note::EmptyCells { rows: 1 }.to_string();
    assert_eq!(one, "1 row lacks a coordinate (an empty cell, or a word such as NA) and counts as NaN");
    // Tabs that only fill up are white space.
    assert_eq!(read("1\t\t2\t3\n4\t5\t\t6\n").unwrap(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    // An attribute that is not there is NaN.
    let text = "x,y,z,i\n1,2,3,\n4,5,6,7\n";
    let found = Text.attributes(text.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!((found.len(), found[0].name.as_str()), (1, "intensity"));
    let (first, second) = (found[0].values.get(0).unwrap(), found[0].values.get(1));
    assert!(first.is_nan() && second == Some(7.0));
}

#[test]
fn thousands_are_not_decimals() {
    let error = |text: &str| read(text).unwrap_err().to_string();
    let text = "x,y,z\n\"1,234\",\"2,345\",\"3,456\"\n\"5,678\",1,2\n";
    assert!(error(text).contains("line 2: the comma in \"1,234\" may separate thousands"), "{}", error(text));
    assert!(error("x,y,z\n\"1,234.5\",2,3\n").contains("not a number"));
    assert!(error("x,y,z\n\"1,234\",2.5,3\n").contains("thousands"));
    let sure = "x,y,z\n\"1,234\",\"2,5\",\"3,456\"\n";
    assert_eq!(read(sure).unwrap(), [[1.234, 2.5, 3.456]]);
}

#[test]
fn text_is_recognised() {
    for text in ["1 2 3\n", "x,y,z\n1,2,3", "5\n1 2 3\n", "# a\n\n1;2;3"] {
        assert!(Text.recognises(text.as_bytes()), "{text}");
    }
    for text in ["", "# a\n", "hello", "v 1 2 3\n", "1 2\n", "12\n"] {
        assert!(!Text.recognises(text.as_bytes()), "{text}");
    }
    assert!(Text.recognises("1 2 3\n".repeat(2000).as_bytes()));
}
