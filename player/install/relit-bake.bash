# bash completion for relit-bake: options as its --help lists them.
_relit_bake() {
  local cur=${COMP_WORDS[COMP_CWORD]} options suffix
  if [[ $cur == -* ]]; then
    options=$("${COMP_WORDS[0]}" --help 2>/dev/null | grep -oE '(^| |,)--?[a-z][a-z0-9-]*' | tr -d ' ,')
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -d -- "$cur"
      for suffix in gltf glb relit; do compgen -f -X "!*.$suffix" -- "$cur"; done)
  fi
}
complete -F _relit_bake relit-bake
