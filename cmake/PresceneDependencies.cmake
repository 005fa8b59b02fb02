# SPDX-License-Identifier: Apache-2.0
# Every outside library, found once. tools/packages.txt says which Debian package each comes from; tools/layers.txt says
# which module may include which. The same finds stand in prescene-config.cmake.in for those that the libraries link.
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)        # Eigen3::Eigen
find_package(tl-expected REQUIRED)             # tl::expected
find_package(TBB REQUIRED)                     # TBB::tbb
find_package(Random123 REQUIRED)               # Random123::Random123
find_package(hwy REQUIRED)                     # hwy::hwy
find_package(nlohmann_json REQUIRED)           # nlohmann_json::nlohmann_json
find_package(yaml-cpp REQUIRED)                # yaml-cpp
find_package(PNG REQUIRED)                     # PNG::PNG
find_package(JPEG REQUIRED)                    # JPEG::JPEG
find_package(ZLIB REQUIRED)                    # ZLIB::ZLIB
find_package(LZ4 REQUIRED)                     # LZ4::lz4
find_package(Zstd REQUIRED)                    # Zstd::zstd
find_package(Ceres REQUIRED)                   # Ceres::ceres
find_package(assimp REQUIRED)                  # assimp::assimp
find_package(meshoptimizer REQUIRED)          # meshoptimizer::meshoptimizer
find_package(Bullet64 REQUIRED)                # Bullet::float64, Bullet::hacd
find_package(CycloneDDS REQUIRED)              # CycloneDDS::ddsc, idlc_generate()
option(PRESCENE_EGL "Build what draws and computes on OpenGL" ON)
if(PRESCENE_EGL)
  find_package(OpenGL REQUIRED COMPONENTS OpenGL EGL)  # OpenGL::OpenGL, OpenGL::EGL
endif()
find_package(CLI11 REQUIRED)                   # CLI11::CLI11
find_package(spdlog REQUIRED)                  # spdlog::spdlog

if(BUILD_TESTING)
  find_package(GTest REQUIRED)                 # GTest::gmock, GTest::gtest_main
  find_package(rapidcheck REQUIRED)            # rapidcheck, rapidcheck_gtest
  find_package(benchmark REQUIRED)             # benchmark::benchmark
  find_package(fcl REQUIRED)                   # fcl
  find_package(embree 3 REQUIRED)              # embree
  find_package(ODE REQUIRED)                   # ODE::ode
  find_package(MuJoCo REQUIRED)                # MuJoCo::mujoco
endif()
