# bash completion for relit: subcommands and options as relit --help lists them, files by what an option takes.
_relit() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]}
  compopt -o filenames 2>/dev/null
  _relit_files() { # SUFFIX...: folders, and files that end in one of them
    local suffix
    mapfile -t COMPREPLY < <(compgen -d -- "$cur"; for suffix; do compgen -f -X "!*.$suffix" -- "$cur"; done)
  }
  if ((COMP_CWORD == 1)); then
    compopt +o filenames 2>/dev/null
    local names
    names=$("$program" --help 2>/dev/null | sed -n '/^Subcommands:/I,$ s/^  \([a-z][a-z-]*\) .*/\1/p')
    mapfile -t COMPREPLY < <(compgen -W "$names --help --version" -- "$cur")
    return
  fi
  case $prev in
    --light | --lights) _relit_files hdr exr json; return ;;
    --reference) _relit_files npy relit; return ;;
    -o | --output) mapfile -t COMPREPLY < <(compgen -f -- "$cur"); return ;;
    --backend) mapfile -t COMPREPLY < <(compgen -W "egl egl-es2 egl-es2-mediump osmesa cpu" -- "$cur"); return ;;
    --tone-map) mapfile -t COMPREPLY < <(compgen -W "neutral filmic linear" -- "$cur"); return ;;
    --background) mapfile -t COMPREPLY < <(compgen -W "light sh none" -- "$cur"); return ;;
    --composite) mapfile -t COMPREPLY < <(compgen -W "auto cpu texture fused" -- "$cur"); return ;;
  esac
  if [[ ${COMP_WORDS[1]} == measure && $prev == --@(csv|json|html) ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "$cur")
    return
  fi
  if [[ $cur == -* ]]; then
    compopt +o filenames 2>/dev/null
    local options
    options=$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE '(^| |,)--?[a-z][a-z0-9-]*' | tr -d ' ,')
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
    return
  fi
  case ${COMP_WORDS[1]} in
    light) _relit_files hdr exr json ;;
    import) _relit_files relit mkv ;;
    *) _relit_files relit ;;
  esac
}
complete -F _relit relit
