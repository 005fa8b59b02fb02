# SPDX-License-Identifier: Apache-2.0
# To be sourced by test scripts that use the bus: take_domain [FOLDER] sets `domain` to a DDS domain that no other process
# has which asks here or in tests/support/bus_domain.h, whose files these are. The lock lasts until the script and the
# programs that it starts have ended. Fails where none is free.
take_domain() {
  _folder=${1:-/tmp}
  for domain in $(seq 96 -1 1); do
    _file=$_folder/prescene_test_domain_$domain
    # Without a subshell, a redirection that fails would end the script.
    [ -e "$_file" ] || (umask 022; : > "$_file") 2> /dev/null || continue
    [ -r "$_file" ] || continue
    exec 9< "$_file"
    if flock --nonblock 9; then return 0; fi
  done
  echo "no DDS domain from 1 to 96 is free: other processes have locked $_folder/prescene_test_domain_*" >&2
  return 1
}
