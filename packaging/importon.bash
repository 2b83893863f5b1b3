# SPDX-License-Identifier: Apache-2.0
# bash completion for importon: commands, options and their values (asked from the program),
# parameters of the scene that is named, files.

# _importon_parameters: of the first scene on the command line.
_importon_parameters()
{
    local other
    for other in "${COMP_WORDS[@]:2}"; do
        [[ $other == *.xml && -f $other ]] || continue
        importon info --dump -q "$other" 2>/dev/null | cut -d = -f 1
        return
    done
}
_importon()
{
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]:-} words
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        words="$(importon help 2>/dev/null | sed -n 's/^  \([a-z][a-z]*\) .*/\1/p') help --version --help"
    elif [[ $command == help ]]; then
        words=$(importon help 2>/dev/null | sed -n 's/^  \([a-z][a-z]*\) .*/\1/p')
    elif [[ $word == -* ]]; then
        words=$(importon help "$command" 2>/dev/null | grep -o -- '^  \(-.,\|   \) --[a-z0-9-]*' | cut -c 7-)
    elif [[ $before == -* ]]; then
        words=$(importon help "$command" "$before" 2>/dev/null) # lower case: what it may be; upper: what it is called
        case $words in
            GLOB* | *ID=*) words=$(_importon_parameters) ;;
            FILE* | DIR* | PATH* | [A-Z]*) words= ;;
        esac
    elif ((COMP_CWORD == 2)) && [[ $command == bend ]]; then
        words='trace check fit view'
    elif ((COMP_CWORD == 2)) && [[ $command == selftest ]]; then
        words='material light camera phase medium shape'
    fi
    if [[ $words ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    else
        mapfile -t COMPREPLY < <(compgen -f -- "$word")
    fi
}
complete -o filenames -F _importon importon
