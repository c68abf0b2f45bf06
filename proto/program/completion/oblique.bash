# Completion of bash for oblique, oblique-server and oblique-worker: the program that is typed is asked.
# By itself, from the source tree too:  source proto/program/completion/oblique.bash
_oblique() {
  local program=${1/#\~\//"$HOME"/} answer=() found=()
  mapfile -d '' -t answer < <(
    command "$program" __complete bash "${COMP_TYPE-}" "${COMP_LINE:0:COMP_POINT}" "${2-}" 2> /dev/null < /dev/null
  )
  COMPREPLY=("${answer[@]:1}")
  case ${answer[0]-} in
    open) compopt -o nospace ;;
    folders)
      compopt -o filenames
      mapfile -t COMPREPLY < <(compgen -d -- "${2-}")
      ;;
    files*)
      compopt -o filenames
      # Those that are meant, and folders to look into; any others where there are none.
      mapfile -t found < <(compgen -f -X "!*.${answer[0]#files }" -- "${2-}")
      mapfile -t COMPREPLY < <(compgen -d -- "${2-}")
      if ((${#found[@]} > 0)); then
        COMPREPLY+=("${found[@]}")
      else
        mapfile -t COMPREPLY < <(compgen -f -- "${2-}")
      fi
      ;;
  esac
}
complete -F _oblique oblique oblique-server oblique-worker
