# SPDX-License-Identifier: Apache-2.0
# bash completion for importon: commands, options (asked from the program), files.
_importon()
{
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]:-}
    if ((COMP_CWORD == 1)); then
        COMPREPLY=($(compgen -W "$(importon help 2>/dev/null |
            sed -n 's/^  \([a-z][a-z]*\) .*/\1/p') help --version --help" -- "$word"))
    elif [[ $command == help ]]; then
        COMPREPLY=($(compgen -W "$(importon help 2>/dev/null |
            sed -n 's/^  \([a-z][a-z]*\) .*/\1/p')" -- "$word"))
    elif [[ $word == -* ]]; then
        COMPREPLY=($(compgen -W "$(importon help "$command" 2>/dev/null |
            grep -o -- '--[a-z0-9-]*' | sort -u)" -- "$word"))
    else
        COMPREPLY=($(compgen -f -- "$word"))
    fi
}
complete -o filenames -F _importon importon
