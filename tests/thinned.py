"""Tests of many cases that each take long: of these every n-th stays in the suite, `make check-long` runs the others.

A case of each kind is enough to see that something broke; all of them are needed to see what. Long tests whose subject
has a shorter one are marked slow and left out whole.
"""

from __future__ import annotations

THINNED = {
    "test_inputs_precision": {"test_a_march_is_that_of_the_same_numbers": 4},
    "test_accuracy": {
        "test_the_error_is_what_was_asked": 10,
        "test_uniform_increments_of_that_error_cost_as_much": 3,
    },
    "test_accuracy_mesh": {"test_without_friction_every_element_is_exact": 12},
    "test_accuracy_paced": {"test_the_true_error_is_that_of_the_closed_form_without_friction": 2},
    "test_adversary_sampling": {
        "test_a_mean_at_a_plane_of_symmetry_is_that_of_the_whole_body": 3,
        "test_friction_where_a_support_holds_one_node_of_a_mean_is_felt_by_the_others": 9,
    },
    "test_coulomb_soundness": {"test_no_single_solver_converges_where_no_solution_exists": 12},
    "test_curved_between": {
        "test_a_centre_off_the_plane_by_round_off_leaves_no_friction_at_the_pole": 2,
        "test_a_circle_smaller_than_an_edge_does_not_come_in_between_its_nodes": 20,
    },
    "test_curved_forms": {"test_forms_of_the_exact_law_agree": 6},
    "test_curved_means": {
        "test_a_roll_that_a_moment_turns_has_the_moment_of_nodal_forces": 2,
        "test_rows_and_newtons_tangent_are_derivatives": 3,
        "test_the_law_holds_of_means_recomputed_from_places": 2,
        "test_the_tangent_of_driven_tools_is_that_of_differences": 2,
    },
    "test_curved_tools": {
        "test_a_march_goes_on_from_every_course_to_the_last_bit": 2,
        "test_a_node_does_not_come_out_of_the_punch_on_its_far_side": 2,
        "test_the_law_holds_between_positions": 2,
    },
    "test_determinism": {"test_a_march_is_the_same_by_turns_with_another_and_in_a_thread_beside_it": 9},
    "test_driven_attacks": {"test_a_roll_on_a_long_arm_goes_on_from_a_state": 2},
    "test_driven_rolls": {
        "test_a_roll_turns_with_the_body_and_its_moment_is_that_of_nodal_forces": 3,
        "test_units_do_not_matter_to_a_roll": 2,
    },
    "test_driven_soundness": {"test_a_tool_dragged_by_friction_is_held_by_it_from_the_first_increment_on": 3},
    "test_element_results": {"test_every_form_takes_every_element": 3},
    "test_energy": {"test_the_trapezoidal_balance_closes_with_order_two": 4},
    "test_exchange": {"test_the_march_takes_any_of_them_for_its_coupling": 3},
    "test_fixed_point": {"test_the_contraction_of_the_design_is_seen": 2},
    "test_flow": {
        "test_a_tool_that_stops_slows_down_or_turns_gives_the_force_of_backward_euler": 3,
        "test_what_the_stored_flow_misses_falls_with_the_increment_and_is_nothing_with_backward_euler": 2,
    },
    "test_fuzz": {"test_what_the_judge_once_took_for_wrong_is_certified": 2},
    "test_fuzz_shaped": {
        "test_drawn_scenes_with_shaped_tools_pass_the_recomputation": 4,
        "test_energies_of_a_body_that_a_gap_of_round_off_moves_are_not_compared": 2,
        "test_what_is_right_passes_and_its_energies_forces_and_moments_are_the_library_s": 2,
    },
    "test_fuzz_shaped_means": {
        "test_drawn_scenes_in_means_and_their_variants_pass_the_recomputation": 6,
    },
    "test_fuzz_solid_posed": {
        "test_caps_are_those_of_the_library": 3,
        "test_unfolded_a_body_has_the_same_forces_on_each_half": 2,
    },
    "test_fuzz_solid_shaped": {"test_what_is_right_passes_and_energies_and_slips_are_the_library_s": 2},
    "test_golden": {"test_no_number_moves": 5},
    "test_hard_cases": {"test_hard_cases_end_as_they_must": 3},
    "test_idle": {"test_tools_that_rest_move_nothing_in_any_number_of_increments": 4},
    "test_inclined": {
        "test_a_pressed_block_turned_by_thirty_degrees_keeps_its_forces": 3,
        "test_so_does_every_other_scene_by_newton": 3,
    },
    "test_inclined_in_space": {
        "test_a_scene_turned_in_space_keeps_its_forces": 15,
        "test_what_supports_and_a_tool_hold_both_is_the_supports_share_along_any_direction": 4,
    },
    "test_independent": {"test_drawn_scenes_of_other_elements_pass_the_recomputation": 4},
    "test_independent_sampling": {"test_variants_of_weighted_scenes_agree_and_forces_that_differ_are_found": 3},
    "test_laws_capped": {"test_newton_finds_the_solution_that_trying_all_cases_finds": 4},
    "test_laws_penalised": {
        "test_tangential_derivatives": 2,
        "test_tangential_potential_lies_between_every_primal_and_every_dual_value": 2,
    },
    "test_laws_von_mises": {
        "test_return_satisfies_every_equation": 3,
        "test_return_minimises_the_incremental_energy": 5,
    },
    "test_loads_and_tools": {"test_a_corner_right_behind_a_scheduled_time_is_landed_on": 3},
    "test_march": {
        "test_energy_balance_closes_to_a_thousandth": 2,
        "test_frictionless_hardening_is_exact": 2,
        "test_hardening_certified_and_forms_agree": 3,
        "test_units_do_not_matter": 3,
    },
    "test_mesh_elements": {"test_a_file_there_and_back_gives_the_forces_of_the_native_mesh": 5},
    "test_moved_bodies": {
        "test_a_body_that_flows_freely_does_not_shear_itself_to_and_fro": 3,
        "test_slip_does_not_jump_where_supports_ask_for_more_than_a_translation": 4,
    },
    "test_newton": {
        "test_newton_and_conic_forms_agree": 15,
        "test_newton_takes_shared_and_inclined_contacts_as_the_conic_form_does": 4,
    },
    "test_orientation_elements": {"test_the_scaled_jacobian_is_a_lower_bound_within_its_tolerance": 3},
    "test_pages": {
        "test_a_page_prints_what_it_says": 8,
        "test_the_blocks_of_a_page_run": 3,
    },
    "test_paper_figs": {
        "test_figures_write_pdf_and_png": 4,
        "test_no_text_is_cut_off_or_covers_another": 4,
        "test_tractions_of_every_increment_have_the_sign_and_are_in_the_cone": 2,
    },
    "test_paper_figs_any_run": {
        "test_a_run_that_stopped_is_drawn_as_far_as_it_came_and_said": 4,
        "test_another_cylinder_has_no_limit": 5,
        "test_every_figure_of_every_kind_is_whole_and_legible": 36,
    },
    "test_penalty": {"test_newton_finds_the_minimum_from_anywhere": 2},
    "test_processes": {"test_a_job_that_fails_ends_the_study_with_its_own_sentence": 2},
    "test_profile_inputs": {"test_a_face_in_two_parts_is_slid_along_as_in_one": 6},
    "test_profile_marches": {
        "test_a_tool_goes_in_by_a_tenth_and_every_increment_is_certified": 6,
        "test_forms_of_the_exact_law_agree": 9,
        "test_on_a_meridian_they_are_a_cone_and_a_cylinder": 2,
    },
    "test_profiles": {"test_the_least_gap_along_an_edge_is_that_of_a_fine_sampling": 6},
    "test_program_damage": {"test_damaged_files_are_refused": 2},
    "test_projection": {"test_every_form_finds_the_same_certified_increment": 5},
    "test_resume": {"test_a_study_leaves_goes_on_with_or_replaces_its_results": 2},
    "test_resume_march": {"test_a_march_goes_on_from_every_course_to_the_last_bit": 16},
    "test_reuse": {
        "test_raw_answers_of_updated_programs_are_those_of_the_statement": 2,
        "test_updated_programs_have_the_answers_of_the_cvxpy_statement": 2,
    },
    "test_sampling": {
        "test_all_forms_agree": 12,
        "test_the_multipliers_obey_the_law_and_carry_the_force": 3,
    },
    "test_shear": {
        "test_newton_takes_few_passes_with_caps": 3,
        "test_the_measures_are_those_of_a_recomputation": 2,
        "test_units_do_not_matter": 2,
    },
    "test_shear_scenes": {"test_a_mirror_image_does_the_mirrored_thing": 2},
    "test_shear_solid": {
        "test_a_slice_whose_depth_is_held_is_a_slab_in_plane_strain": 2,
        "test_newton_tangent_and_dissipation_agree": 10,
    },
    "test_signals": {"test_ctrl_c_while_a_study_imports_is_a_sentence": 3},
    "test_solid_contact": {
        "test_every_exact_form_finds_the_same_forces_and_the_certificate_holds": 4,
        "test_frames_turned_about_the_normal_change_nothing": 3,
    },
    "test_solid_sampling_halves": {"test_a_tool_askew_to_a_plane_of_symmetry_meets_its_own_half_of_the_body": 2},
    "test_solid_sampling_marches": {"test_forms_agree_and_the_certificate_holds": 3},
    "test_solid_soundness": {"test_friction_that_slides_holds_a_body_across_its_slip": 2},
    "test_solvers": {"test_all_solvers_find_one_objective_and_pass_our_residuals": 2},
    "test_soundness": {
        "test_a_body_held_by_its_platens_alone_takes_the_least_motion_and_says_so": 3,
        "test_an_elastic_answer_does_not_depend_on_the_yield_stress": 3,
        "test_contact_forces_agree_between_units_in_a_nearly_incompressible_body": 4,
        "test_tiny_travel_gives_the_elastic_stiffness_and_is_certified_sharply": 5,
    },
    "test_space_curved_means": {
        "test_every_form_finds_the_same_forces_under_a_sphere": 4,
        "test_gaps_and_forces_are_those_of_means_by_hand": 2,
        "test_rows_and_newtons_tangent_are_derivatives": 2,
    },
    "test_space_driven_turns": {
        "test_a_roll_across_a_slab_is_the_circle_in_plane_strain": 2,
        "test_the_tangent_is_that_of_differences": 3,
    },
    "test_space_tools": {"test_every_form_finds_the_same_forces_under_a_sphere": 8},
    "test_starting": {"test_every_state_of_a_march_is_a_start": 3},
    "test_streams": {"test_a_help_that_nobody_reads_is_quiet": 4},
    "test_study_elements": {"test_a_series_extrapolates_to_the_exact_limit_load": 3},
    "test_study_upsetting": {"test_every_form_runs_from_the_command_line": 6},
    "test_symmetry": {
        "test_each_plane_of_a_block_between_platens_leaves_the_forces_and_energies_of_the_whole": 3,
        "test_the_mirror_image_meshed_has_the_same_forces_and_energies": 9,
    },
    "test_tables": {"test_what_is_no_file_of_text_is_refused": 2},
    "test_total": {"test_its_contact_between_quadratic_faces_is_soft_without_friction_too": 2},
    "test_turning_tools": {
        "test_forms_agree_under_a_punch_that_turns": 2,
        "test_turning_a_pressed_body_with_its_platens_takes_no_work": 2,
    },
    "test_writing_costs": {"test_writing_takes_a_tenth_of_a_run_at_most": 2},
}
"""n by module and test."""
