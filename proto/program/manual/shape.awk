# Turns help as CLI11 prints it into help that help2man formats well: annotations behind a flag move
# into its sentence, notes join the description. Variables: nested (name of a subcommand; empty for
# others), examples (output file for the section [EXAMPLES]).
{ line[NR] = $0 }

function trimmed(text) { gsub(/^ +| +$/, "", text); return text }

# Removes `word` and the flags after it from `head`, and returns the flags as "--a, --b".
function taken_from_head(word,    at, rest, count, names, i, given) {
  at = index(head, " " word ":")
  if (!at) return ""
  rest = substr(head, at + length(word) + 2)
  head = substr(head, 1, at - 1)
  count = split(rest, names, " ")
  given = ""
  for (i = 1; i <= count; ++i) {
    if (names[i] !~ /^--/) { head = head " " names[i]; continue }
    given = given (given == "" ? "" : ", ") names[i]
  }
  return given
}

# Prints one option or argument: its head, and its meaning with CLI11's annotations.
function print_option(text,    excludes, needs, required, default_, at, type) {
  head = trimmed(head)
  at = index(head, " Needs:")
  excludes = taken_from_head("Excludes")
  needs = taken_from_head("Needs")
  required = sub(/ REQUIRED$/, "", head)
  many = sub(/ \.\.\.$/, "", head)
  default_ = ""
  if (match(head, / [^ =]+=/) && head !~ /KEY=VALUE$/) {
    default_ = substr(head, RSTART + RLENGTH)
    head = substr(head, 1, RSTART + RLENGTH - 2)
  } else if (match(head, /\]=/)) {
    default_ = substr(head, RSTART + 2)
    head = substr(head, 1, RSTART)
  }
  if (match(head, /:[A-Z]+ in \[.*\]$/)) {
    type = substr(head, RSTART + 1)
    head = substr(head, 1, RSTART - 1)
    gsub(/^[A-Z]+ in \[|\]$/, "", type)
    sub(/ - /, " to ", type)
    text = text ", " type
  }
  sub(/ UINT$| INT$/, " N", head)
  sub(/^-h,/, "-h, ", head)
  sub(/^-y,/, "-y, ", head)
  if (required && head ~ /^-/) text = text "; required"
  # Omit a default that depends on the machine; the text names it.
  if (default_ != "" && default_ != "[]" && text !~ /default is/) text = text "; default: " default_
  if (needs != "") text = text "; only with " needs
  if (excludes != "") text = text "; not with " excludes
  printf "  %s\n%30s%s\n", head, "", text
}

function print_entry(i,    text) {
  if (substr(line[i + 1], 1, column - 1) ~ /^ +$/ && substr(line[i], 4) !~ /  /) {
    head = line[i]
    text = trimmed(line[++i])
  } else {
    head = substr(line[i], 1, column - 1)
    text = trimmed(substr(line[i], column))
  }
  while (i < NR && substr(line[i + 1], 1, column - 1) ~ /^ +$/) text = text " " trimmed(line[++i])
  print_option(text)
  return i
}

# Prints an example: its description as a comment above it, a long command on several lines.
function print_example(text,    at, comment, command) {
  text = trimmed(text)
  comment = ""
  if (match(text, /   */)) {
    comment = trimmed(substr(text, RSTART))
    text = substr(text, 1, RSTART - 1)
  }
  if (shown++) print "" > examples
  if (comment != "") print "# " comment > examples
  command = ""
  while (length(text) > 66 && (at = last_flag(text)) > 0) {
    command = command substr(text, 1, at - 1) " \\\n    "
    text = substr(text, at + 1)
  }
  command = command text
  gsub(/\\/, "\\e", command)
  print command > examples
}

# Position of the blank before the last flag within the first 66 characters; 0: none.
function last_flag(text,    i) {
  for (i = 66; i > 20; --i) if (substr(text, i, 3) == " --") return i
  for (i = 67; i < length(text); ++i) if (substr(text, i, 3) == " --") return i
  return 0
}

END {
  for (i = 1; i <= NR; ++i) if (line[i] ~ /^  -h,--help/) column = index(line[i], "Print this help")
  about = ""
  body = 0
  for (i = 1; i <= NR && line[i] !~ /^Usage:/; ++i) {
    if (line[i] ~ /^Example: /) print_example(substr(line[i], 10))
    else about = about line[i] "\n"
  }
  sub(/\n$/, "", about)
  if (about !~ /\.$/) about = about "."
  about = about "\n"
  first = i + 1
  # Below the options: examples and notes.
  for (last = NR; last > first && line[last] !~ /^  /; --last) {}
  for (i = first; i <= NR; ++i) if (line[i] ~ /^Examples:/) { last = i - 1; break }
  notes = ""
  for (i = last + 1; i <= NR; ++i) {
    if (line[i] ~ /^Examples:/) {
      while (line[i + 1] ~ /^  /) print_example(line[++i])
    } else if (line[i] !~ /^Exit codes:/) {
      # Keep indented lines as they are.
      notes = notes line[i] (line[i] ~ /^  / ? "\n\n" : "\n")
    }
  }
  if (nested) {
    printf "*%s*\n\n%s\n", nested, about
  } else {
    printf "%s\n%s\n", about, notes
  }
  for (i = first; i <= last; ++i) {
    if (line[i] ~ /^Positionals:/) print "Arguments:"
    else if (line[i] ~ /^Options:/) print nested ? "Flags:" : "Options:\n"
    else if (line[i] ~ /^Subcommands:/) print "*Commands*\n"
    else if (line[i] ~ /^  [^ ]/) i = print_entry(i)
    else print line[i]
  }
}
