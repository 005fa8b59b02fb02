// SPDX-License-Identifier: Apache-2.0
#include "security_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <string>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {

core::Status use_security(const std::filesystem::path& folder, dds_qos_t* qos) {
  const auto set = [qos](const std::string& name, const std::string& value) {
    dds_qset_prop(qos, ("dds.sec." + name).c_str(), value.c_str());
  };
  // The three plugins that come with Cyclone DDS.
  const auto use = [&set](const std::string& kind, const char* library, const char* what) {
    set(kind + ".library.path", library);
    set(kind + ".library.init", std::string("init_") + what);
    set(kind + ".library.finalize", std::string("finalize_") + what);
  };
  use("auth", "dds_security_auth", "authentication");
  use("crypto", "dds_security_crypto", "crypto");
  use("access", "dds_security_ac", "access_control");
  struct Row {
    const char* property;
    const char* file;
  };
  constexpr Row kRows[] = {{"auth.identity_ca", "identity_ca.cert.pem"},
                           {"auth.identity_certificate", "cert.pem"},
                           {"auth.private_key", "key.pem"},
                           {"access.permissions_ca", "permissions_ca.cert.pem"},
                           {"access.governance", "governance.p7s"},
                           {"access.permissions", "permissions.p7s"}};
  for (const Row& row : kRows) {
    const std::filesystem::path path = folder / row.file;
    std::error_code error;
    const bool is_file = std::filesystem::is_regular_file(path, error);
    const int file = is_file ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0)
      return core::invalid_input("security: " + quote(path.string(), 1000) +
                                 " can't be read: a folder of tools/security_keys, or an enclave of SROS 2, is needed");
    ::close(file);
    set(row.property, "file:" + path.string());
  }
  return core::ok_status();
}

}  // namespace prescene::interfaces
