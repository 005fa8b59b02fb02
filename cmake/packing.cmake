# SPDX-License-Identifier: Apache-2.0
# Read by cpack before it packs: each component is installed by itself, without what it uses (PresceneInstall.cmake).
set(ENV{PRESCENE_PACKING} 1)
