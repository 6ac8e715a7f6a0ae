# bash completion for relit-bake: options as its --help lists them.
_relit_bake() {
  local cur=${COMP_WORDS[COMP_CWORD]} options
  if [[ $cur == -* ]]; then
    options=$("${COMP_WORDS[0]}" --help 2>/dev/null | grep -oE '(^| |,)--?[a-z][a-z0-9-]*' | tr -d ' ,')
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
  else
    compopt -o filenames 2>/dev/null
    local IFS=$'\n'
    mapfile -t COMPREPLY < <(compgen -d -- "$cur"; compgen -f -X '!*.@(gltf|glb|relit)' -- "$cur")
  fi
}
complete -F _relit_bake relit-bake
