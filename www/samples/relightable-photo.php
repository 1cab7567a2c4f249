<?php
/**
 * Plugin Name: Relightable photographs
 * Description: [relightable_photo src="…" alt="…" light="torch"], and uploads of .ltm files.
 * Requires at least: 6.5
 */

defined( 'ABSPATH' ) || exit;

add_filter( 'upload_mimes', function ( $types ) {
	$types['ltm'] = 'application/vnd.ltm';
	return $types;
} );

// The package's dist folder is next to this file.
add_action( 'init', function () {
	wp_register_script_module(
		'relightable-photo',
		plugins_url( 'dist/relightable-photo.js', __FILE__ )
	);
} );

add_shortcode( 'relightable_photo', function ( $attributes ) {
	$names = array( 'src', 'alt', 'light', 'poster', 'zoom', 'kiosk' );
	$html  = '<relightable-photo controls cooperative-gestures';
	foreach ( $names as $name ) {
		if ( isset( $attributes[ $name ] ) ) {
			$value = in_array( $name, array( 'src', 'poster' ), true )
				? esc_url( $attributes[ $name ] )
				: esc_attr( $attributes[ $name ] );
			$html .= " $name=\"$value\"";
		}
	}
	wp_enqueue_script_module( 'relightable-photo' );
	return $html . '></relightable-photo>';
} );
