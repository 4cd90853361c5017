# Completion of splid's commands, options and their values in bash. It asks splid --help for them,
# so that it knows what the installed program knows.

_splid() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local program=${COMP_WORDS[0]} command=() help word
  help=$("$program" --help 2>/dev/null)
  # Words that the help lists as commands lead to their own help.
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $(_splid_commands "$help") =~ (^|$'\n')"$word"($|$'\n') ]] || continue
    command+=("$word")
    help=$("$program" "${command[@]}" --help 2>/dev/null)
  done

  local candidates
  if [[ $current == -* ]]; then
    candidates=$(grep -oE '^  -[^ ]+' <<<"$help" | tr -d ' ' | tr ',' '\n')
  elif [[ $previous == -* ]] && grep -qE "^  ([^ ]*,)?$previous(,[^ ]*)? [A-Z]" <<<"$help"; then
    candidates=$(_splid_values "$(grep -E "^  ([^ ]*,)?$previous(,[^ ]*)? " <<<"$help")")
  else
    candidates=$(
      _splid_commands "$help"
      _splid_values "$(sed -n '/^Positionals:/,/^$/p' <<<"$help")"
    )
  fi
  # With none, bash completes the names of files (complete -o default).
  mapfile -t COMPREPLY < <(compgen -W "$candidates" -- "$current")
}

# The commands that a help lists.
_splid_commands() { sed -n '/^Subcommands:/,$ s/^  \([a-z][^ ]*\).*/\1/p' <<<"$1"; }

# The values of "--log-level TEXT:{debug,info}".
_splid_values() { sed -n 's/.*{\([^}]*\)}.*/\1/p' <<<"$1" | tr ',' '\n'; }

complete -o default -F _splid splid
