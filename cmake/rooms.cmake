# Rooms and the arrows between them (docs/architecture.md, section 1). A forbidden arrow stops the configure step.
set_property(GLOBAL PROPERTY GLOBAL_DEPENDS_NO_CYCLES ON)

set(GEOCAGE_LIBRARIES pipeline_api geometry topology hands motion physics)
set(geocage_arrows_pipeline_api "")
set(geocage_arrows_pipeline pipeline_api)
set(geocage_arrows_geometry pipeline_api)
set(geocage_arrows_topology pipeline_api geometry)
set(geocage_arrows_hands pipeline_api geometry topology)
set(geocage_arrows_motion pipeline_api geometry topology hands)
set(geocage_arrows_physics pipeline_api geometry hands)
set(geocage_arrows_datasets pipeline_api geometry)
set(geocage_arrows_reports pipeline_api geometry topology hands)

function(_geocage_room kind name allowed)
  cmake_parse_arguments(ROOM "" "" "SOURCES;ROOMS;USES" ${ARGN})
  foreach(other IN LISTS ROOM_ROOMS)
    if(NOT other IN_LIST allowed)
      list(JOIN allowed ", " list)
      message(FATAL_ERROR "${kind} '${name}' must not link '${other}'; it may link: ${list}. See docs/architecture.md, section 1.")
    endif()
  endforeach()
  list(TRANSFORM ROOM_ROOMS PREPEND "geocage_" OUTPUT_VARIABLE rooms)
  add_library(geocage_${name} STATIC ${ROOM_SOURCES})
  target_include_directories(geocage_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(geocage_${name} PUBLIC geocage_flags ${rooms} ${ROOM_USES})
endfunction()

# geocage_library_room(geometry SOURCES a.cpp ROOMS pipeline_api USES Eigen3::Eigen)
function(geocage_library_room name)
  _geocage_room("room" ${name} "${geocage_arrows_${name}}" ${ARGN})
endfunction()

# geocage_stage_room(remesh SOURCES remesh.cpp ROOMS geometry USES CGAL::CGAL): library rooms only, never another stage.
function(geocage_stage_room name)
  _geocage_room("stage" stage_${name} "${GEOCAGE_LIBRARIES}" ${ARGN})
endfunction()

# geocage_test(topology SOURCES writhe_test.cpp ROOMS topology): one GoogleTest binary for a room, run by CTest test by test, or
# suite by suite where SUITES names them (suites that share a costly set-up).
function(geocage_test name)
  cmake_parse_arguments(TEST "" "" "SOURCES;ROOMS;USES;SUITES" ${ARGN})
  list(TRANSFORM TEST_ROOMS PREPEND "geocage_" OUTPUT_VARIABLE rooms)
  add_executable(${name}_test ${TEST_SOURCES})
  target_link_libraries(${name}_test PRIVATE geocage_flags ${rooms} ${TEST_USES} GTest::gtest_main)
  target_compile_options(${name}_test PRIVATE $<$<CONFIG:Release>:-O1>) # a third less time to compile than -O2
  if(NOT TEST_SUITES)
    gtest_discover_tests(${name}_test DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
  endif()
  foreach(suite IN LISTS TEST_SUITES)
    add_test(NAME ${name}.${suite} COMMAND ${name}_test --gtest_filter=${suite}.*)
    set_tests_properties(${name}.${suite} PROPERTIES TIMEOUT 900)
  endforeach()
endfunction()
