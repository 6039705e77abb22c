# --help and --help-json: options, examples and exit statuses.
# shellcheck shell=bash

# What JSON must say of the options: the same as --help. Prints differences.
compare_json() { # HELP JSON
  python3 - "$1" "$2" <<'END'
import json, re, sys
text, tool = open(sys.argv[1]).read(), json.load(open(sys.argv[2]))
options = text.split("\nOptions:\n")[1].split("\n\n")[0]
lines = re.sub(r"\n {20,}", "  ", options).split("\n")
told = {}
for line in lines:
    names, help_text = re.split(r" {2,}", line.strip(), maxsplit=1)
    words = names.split(" ")
    told[words[0].split(",")[-1]] = (words[0].split(",")[0] if "," in words[0] else None,
                                     words[1].rstrip(".") if len(words) > 1 else None, help_text)
json_told = {}
for option in tool["options"]:
    default = f" (default {option['default']})" if "default" in option else ""
    json_told[option["name"]] = (option.get("short"), option.get("value"), option["help"] + default)
    assert ("value" in option) == ("type" in option), option
    assert option.get("type") in (None, "number", "whole number", "numbers", "text"), option
for name in sorted(set(told) | set(json_told)):
    if told.get(name) != json_told.get(name):
        print(name, told.get(name), json_told.get(name))
for example in tool["examples"]:
    if f"  # {example['what']}\n  {example['command']}\n" not in text:
        print("no example", example)
for number, meaning in tool["exit_statuses"].items():
    if f"  {number}  {meaning}\n" not in text:
        print("no status", number)
if sorted(tool["exit_statuses"]) != ["0", "1", "2"] or not tool["examples"] or not tool["operands"]:
    print("lacks examples, operands or exit statuses")
END
}

test_json_says_what_help_says() {
  local tool difference
  for tool in $(programs); do
    "$tool" --help >help.txt
    "$tool" --help-json >help.json
    difference=$(compare_json help.txt help.json) || fail "$tool --help-json is not understood"
    [[ ! $difference ]] || fail "$tool --help-json differs from --help:" "$difference"
    [[ $(python3 -c 'import json; print(json.load(open("help.json"))["program"])') == "$tool" ]] || fail "not $tool"
  done
  # The program that starts the others has options alone.
  gewebe --help >starter.txt
  gewebe --help-json >starter.json
  difference=$(compare_json starter.txt starter.json) || fail 'gewebe --help-json is not understood'
  [[ ! $difference ]] || fail 'gewebe --help-json differs from --help:' "$difference"
  # Another option, default or value is seen.
  sed 's/"--threads"/"--thread"/' help.json >other.json
  [[ $(compare_json help.txt other.json) ]] || fail 'another option passes'
  sed 's/"default": "auto"/"default": "never"/' help.json >other.json
  [[ $(compare_json help.txt other.json) ]] || fail 'another default passes'
}

# Those of all programs, in one folder, one after the other.
run_examples() { # JSON...
  python3 -c 'import json, sys
for path in sys.argv[1:]:
    for example in json.load(open(path))["examples"]: print(example["command"])' "$@" >commands
  mkdir folder
  local command
  while read -r command; do
    (cd folder && bash -euo pipefail -c "$command" </dev/null) >out.txt 2>err.txt || { echo "status $?: $command"; cat err.txt; return; }
    ! grep -v ': warning: ' err.txt || { echo "is not silent: $command"; return; }
  done <commands
}

test_examples_run() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local tool said
  for tool in $(gewebe --list | cut -d ' ' -f 1); do
    "$tool" --help-json >"$tool.json"
    printf '%s.json\n' "$tool" >>order
  done
  mapfile -t order <order
  said=$(run_examples "${order[@]}")
  [[ ! $said ]] || fail "$said"
  [[ -s folder/run.png && -s folder/run.h5 ]] || fail 'hardly anything was made' "$(ls folder)"
  # One that fails is seen.
  rm -r folder
  said=$(run_examples csg.json)
  [[ $said == 'status 1: csg'* ]] || fail 'a broken example passes' "$said"
}
