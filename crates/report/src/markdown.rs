//! The writer of pages in Markdown.

/// A page that is written from top to bottom.
#[derive(Default)]
pub struct Markdown(String);

impl Markdown {
    /// Adds a line as it is.
    pub fn line(&mut self, line: impl AsRef<str>) {
        self.0.push_str(line.as_ref());
        self.0.push('\n');
    }

    /// Adds a paragraph, with an empty line after it.
    pub fn paragraph(&mut self, text: impl AsRef<str>) {
        self.line(text);
        self.line("");
    }

    /// Adds a heading: of the page at level 1, of a chapter at level 2.
    pub fn heading(&mut self, level: usize, title: &str) {
        self.paragraph(format!("{} {title}", "#".repeat(level)));
    }

    /// Adds a table, with an empty line after it.
    pub fn table<const N: usize>(&mut self, heads: [&str; N], rows: impl IntoIterator<Item = [String; N]>) {
        self.line(row(&heads.map(String::from)));
        self.line(format!("|{}", "---|".repeat(N)));
        rows.into_iter().for_each(|cells| self.line(row(&cells)));
        self.line("");
    }

    /// Adds a drawing and its caption.
    pub fn drawing(&mut self, caption: &str, file: &str) {
        self.paragraph(format!("![{caption}]({file})"));
    }

    /// The text of the page.
    pub fn text(self) -> String {
        let mut text = self.0;
        text.truncate(text.trim_end().len());
        text.push('\n');
        text
    }
}

fn row(cells: &[String]) -> String {
    format!("| {} |", cells.join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_page_are_told_apart_by_empty_lines() {
        let mut page = Markdown::default();
        page.heading(1, "Title");
        page.table(["a", ""], [["1".into(), "2".into()]]);
        page.drawing("What", "it.svg");
        assert_eq!(page.text(), "# Title\n\n| a |  |\n|---|---|\n| 1 | 2 |\n\n![What](it.svg)\n");
    }
}
